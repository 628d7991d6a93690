#include "match/smooth_normal_retry.h"

#include <span>
#include <utility>
#include <vector>

#include "match/sample_subset.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

class SmoothNormalRetry : public Matcher {
 public:
  SmoothNormalRetry(std::unique_ptr<Matcher> first, const MatchRequest& request)
      : context_(context_of(request.source.device)),
        surface_(request.surface),
        first_(std::move(first)) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    first_->run(band, match);
    std::vector<std::uint8_t> status(band.sample_count);
    match.status.read(context_, status);
    std::vector<std::uint32_t> missed;
    for (std::uint32_t i = 0; i < band.sample_count; ++i) {
      if (status[i] == KILN_STATUS_MISS) missed.push_back(i);
    }
    if (!missed.empty()) look_again(band, missed, match);
  }

  bool needs_band() const override { return true; }
  void finish(MatchNotes& notes) override { first_->finish(notes); }

 private:
  /// The averaged directions, where they have one, in place of the turned ones: in double precision, which devices
  /// may not have, for the few that miss.
  void turn_back(TexelBand& some) const {
    const std::vector<std::uint32_t> triangle = some.triangle.download(context_);
    const std::vector<float> weights = some.barycentric.download(context_);
    const std::size_t count = triangle.size();
    std::vector<float> directions(3 * count);
    some.points.read(context_, directions, 3 * count);
    for (std::size_t k = 0; k < count; ++k) {
      const float u = weights[k], v = weights[count + k];
      const auto& [a, b, c] = surface_.triangles[triangle[k]];
      const Vec3d direction =
          Vec3d(a.direction) * (1.0 - u - v) + Vec3d(b.direction) * u + Vec3d(c.direction) * v;
      const double size = length(direction);
      if (!(size > 1e-6)) continue;
      const Vec3 unit = to_float(direction * (1 / size));
      directions[k] = unit.x;
      directions[count + k] = unit.y;
      directions[2 * count + k] = unit.z;
    }
    some.points.write(context_, std::span<const float>(directions), 3 * count);
  }

  void look_again(const TexelBand& band, const std::vector<std::uint32_t>& samples,
                  DeviceCorrespondence& match) {
    const auto count = static_cast<std::uint32_t>(samples.size());
    SampleSubset some(context_, band, samples);
    some.take_places(band, band.triangle);
    turn_back(some.band);
    DeviceCorrespondence result(context_, count);
    first_->run(some.band, result);
    some.put_back(result, match);
  }

  cl::Context& context_;
  const LowSurface& surface_;
  std::unique_ptr<Matcher> first_;
};

}  // namespace

std::unique_ptr<Matcher> smooth_normal_retry(std::unique_ptr<Matcher> first,
                                             const MatchRequest& request) {
  return std::make_unique<SmoothNormalRetry>(std::move(first), request);
}

}  // namespace kiln
