#include "detail/hemisphere_map.h"

#include <array>
#include <cmath>

#include "base/parallel.h"
#include "image/gutter.h"
#include "mesh/kernels_shared.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::size_t kTexelsPerTask = 1 << 12;

class HemisphereMap : public MapMaker {
 public:
  using ReadValues = std::vector<float> (Hemispheres::*)(const TexelBand&,
                                                         const DeviceCorrespondence&, bool);

  HemisphereMap(const MapRequest& request, ReadValues read)
      : reads_(request.reads()),
        miss_(request.options.encoding.miss),
        rays_(request.shared.of<Hemispheres>(request)),
        compute_values_(read) {}

  void report(BakedMap& map, std::vector<Warning>&) const override {
    if (compute_values_ == &Hemispheres::visibility) map.occlusion = rays_->report();
  }

  void run(const TexelBand& band, const DeviceCorrespondence& match,
           const BandPixels& out) override {
    if (band.sample_count == 0) return;
    average_samples(*reads_, band, match, miss_, (*rays_.*compute_values_)(band, match, false),
                    band.sample_count, out);
  }

  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares,
                   const BandPixels& out) override {
    if (band.sample_count == 0) return;
    std::vector<float> values = (*rays_.*compute_values_)(band, match, false);
    const std::vector<float> others = (*rays_.*compute_values_)(band, other, true);
    const std::vector<std::uint32_t>& triangle = reads_->read(other.triangle, band.sample_count);
    const std::vector<float>& share = reads_->read(shares, band.sample_count);
    for (std::size_t s = 0; s < values.size(); ++s) {
      if (triangle[s] == KILN_NO_TRIANGLE) continue;
      values[s] = values[s] * share[s] + others[s] * (1 - share[s]);
    }
    average_samples(*reads_, band, match, miss_, values, band.sample_count, out);
  }

 private:
  std::shared_ptr<BandReads> reads_;
  MissPolicy miss_;
  std::shared_ptr<Hemispheres> rays_;
  ReadValues compute_values_;
};

}  // namespace

void average_samples(BandReads& reads, const TexelBand& band, const DeviceCorrespondence& match,
                     MissPolicy miss, std::span<const float> values, std::size_t plane,
                     const BandPixels& out) {
  const std::size_t channels = values.size() >= 3 * plane ? 3 : 1;
  const std::vector<std::uint32_t>& index = reads.read(band.texel_index, band.texel_count);
  const std::vector<std::uint32_t>& first =
      reads.read(band.texel_first, band.texel_count + std::size_t{1});
  const std::vector<std::uint32_t>& triangle = reads.read(match.triangle, band.sample_count);
  parallel_for(band.texel_count, kTexelsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      std::uint8_t& coverage = out.coverage[index[t]];
      coverage = kCoverageMissed;
      std::array<double, 3> sum{};
      std::size_t sample_count = 0, last_sample = 0;
      for (std::size_t s = first[t]; s < first[t + 1]; ++s) {
        if (triangle[s] != KILN_NO_TRIANGLE) {
          coverage = kCoverageBaked;
        } else if (miss != MissPolicy::keep) {
          continue;
        }
        for (std::size_t c = 0; c < channels; ++c) sum[c] += values[s + c * plane];
        ++sample_count;
        last_sample = s;
      }
      float* to = &out.values[index[t] * channels];
      double divisor = static_cast<double>(sample_count);
      if (channels == 3) divisor = length(Vec3d(sum[0], sum[1], sum[2]));
      for (std::size_t c = 0; c < channels; ++c) {
        // If all samples of a texel missed, and MissPolicy gives misses no value, the texel gets 0,
        // or in maps of directions the vector (0, 0, 1).
        to[c] = channels == 3 && c == 2 ? 1.0F : 0.0F;
        // The value of a single sample is copied, not normalized. If the sum of several directions
        // is zero, the last sample's direction is used.
        if (sample_count != 0) {
          to[c] = sample_count == 1 || !(divisor > 1e-10) ? values[last_sample + c * plane]
                                                          : static_cast<float>(sum[c] / divisor);
        }
      }
    }
  });
}

std::unique_ptr<MapMaker> make_hemisphere_map(
    const MapRequest& request,
    std::vector<float> (Hemispheres::*read)(const TexelBand&, const DeviceCorrespondence&, bool)) {
  return std::make_unique<HemisphereMap>(request, read);
}

}  // namespace kiln
