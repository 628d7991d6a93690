// The outermost face within the search distance: one traversal for all samples, and a second pass for
// the few samples whose rays hit several faces outward.
#include "match/outermost.h"

#include <optional>
#include <vector>

#include "match/low_rays.h"
#include "match/ray.h"
#include "shared/ray.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

// Faces closer than this along a ray count as one, since the error of a hit is up to KILN_BVH_EPSILON in both
// directions.
constexpr float kMinFaceSpacing = 4 * KILN_BVH_EPSILON;
class OutermostMatcher : public Matcher {
 public:
  explicit OutermostMatcher(const MatchRequest& request)
      : context_(context_of(request.source.device)),
        rays_(request.source.ray_search()),
        surface_(request.surface),
        nearest_query_(ray_query(request, false)),
        outermost_query_(nearest_query_) {
    outermost_query_.outward_first = false;
    outermost_query_.outermost = true;
  }

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    rays_.intersect(band.points, band.sample_count, band.capacity, outermost_query_, match);
    const std::vector<std::uint32_t> samples_with_several_hits =
        samples_with(context_, match, band.sample_count,
                     [](std::uint8_t status) { return (status & KILN_RAY_SEVERAL) != 0; });
    if (!samples_with_several_hits.empty())
      choose_outermost_faces(band, samples_with_several_hits, match);
  }

 private:
  /// Finds the points of samples whose rays hit several faces outward.
  void choose_outermost_faces(const TexelBand& band, const std::vector<std::uint32_t>& samples,
                              DeviceCorrespondence& match) {
    const auto count = static_cast<std::uint32_t>(samples.size());
    const SamplePick pick(context_, samples);
    const TexelBand picked_band = pick.gather_points(band);
    if (!low_) low_.emplace(context_, surface_);
    low_->write_search_limits(context_, picked_band, outermost_query_.t_max, picked_band.points,
                              6 * count);

    DeviceCorrespondence result(context_, count), outer_match(context_, count);
    rays_.intersect(picked_band.points, count, count, nearest_query_, result);
    RayQuery limited_query = outermost_query_;
    limited_query.has_ray_limits = true;
    rays_.intersect(picked_band.points, count, count, limited_query, outer_match);
    context_.launch(context_.kernel("match", "kiln_match_select_outer"), count, kLocal, count,
                    kMinFaceSpacing, outer_match.triangle, outer_match.barycentric,
                    outer_match.distance, result.triangle, result.barycentric, result.distance,
                    result.status);
    pick.scatter_correspondence(result, match);
  }

  cl::Context& context_;
  const RaySearch& rays_;
  const LowSurface& surface_;
  RayQuery nearest_query_, outermost_query_;
  /// Limits the rays of the second pass where they meet the low poly; created on first use
  std::optional<LowRays> low_;
};

}  // namespace

std::unique_ptr<Matcher> outermost_matcher(const MatchRequest& request) {
  return std::make_unique<OutermostMatcher>(request);
}

}  // namespace kiln
