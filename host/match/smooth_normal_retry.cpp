#include "match/smooth_normal_retry.h"

#include <span>
#include <utility>
#include <vector>

#include "mesh/vector.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

class SmoothNormalRetry : public Matcher {
 public:
  SmoothNormalRetry(std::unique_ptr<Matcher> first, const MatchRequest& request)
      : context_(context_of(request.source.device)),
        surface_(request.surface),
        first_matcher_(std::move(first)) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    first_matcher_->run(band, match);
    const auto missed = samples_with(context_, match, band.sample_count, is_missed);
    if (!missed.empty()) retry_missed(band, missed, match);
  }

  bool needs_whole_texels() const override { return true; }
  void finish(MatchNotes& notes) override { first_matcher_->finish(notes); }

 private:
  /// Replaces blended directions by averaged ones, where these exist. It runs on the host, since few samples
  /// miss, in double precision, which devices may lack.
  void use_averaged_directions(TexelBand& picked_band) const {
    const std::vector<std::uint32_t> triangle = picked_band.triangle.download(context_);
    const std::vector<float> weights = picked_band.barycentric.download(context_);
    const std::size_t count = triangle.size();
    std::vector<float> averaged_directions(3 * count);
    picked_band.points.read(context_, averaged_directions, 3 * count);
    for (std::size_t k = 0; k < count; ++k) {
      const float u = weights[k], v = weights[count + k];
      const auto& [a, b, c] = surface_.triangles[triangle[k]];
      const Vec3d direction = to_double(a.direction) * (1.0 - u - v) +
                              to_double(b.direction) * double{u} +
                              to_double(c.direction) * double{v};
      const double size = length(direction);
      if (!(size > 1e-6)) continue;
      const Vec3 unit = to_float(direction * (1 / size));
      averaged_directions[k] = unit.x;
      averaged_directions[count + k] = unit.y;
      averaged_directions[2 * count + k] = unit.z;
    }
    picked_band.points.write(context_, std::span<const float>(averaged_directions), 3 * count);
  }

  void retry_missed(const TexelBand& band, const std::vector<std::uint32_t>& samples,
                    DeviceCorrespondence& match) {
    const SamplePick pick(context_, samples);
    TexelBand picked_band = pick.gather_points(band);
    picked_band.triangle = pick.of(band.triangle, band.capacity, 1);
    picked_band.barycentric = pick.of(band.barycentric, band.capacity, 2);
    use_averaged_directions(picked_band);
    DeviceCorrespondence result(context_, pick.count());
    first_matcher_->run(picked_band, result);
    pick.scatter_correspondence(result, match);
  }

  cl::Context& context_;
  const LowSurface& surface_;
  std::unique_ptr<Matcher> first_matcher_;
};

}  // namespace

std::unique_ptr<Matcher> smooth_normal_retry(std::unique_ptr<Matcher> first,
                                             const MatchRequest& request) {
  return std::make_unique<SmoothNormalRetry>(std::move(first), request);
}

}  // namespace kiln
