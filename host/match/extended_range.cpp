#include "match/extended_range.h"

#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "match/ray.h"
#include "texel/host_correspondence.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

class ExtendedRange : public Matcher {
 public:
  ExtendedRange(std::unique_ptr<Matcher> near_matcher, const MatchRequest& request)
      : context_(context_of(request.source.device)),
        rays_(request.source.ray_search()),
        matcher_within_range_(std::move(near_matcher)),
        query_(ray_query(request, false)) {
    query_.t_max = static_cast<float>(request.max_sheet_distance);
    query_.t_min = -query_.t_max;
  }

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    matcher_within_range_->run(band, match);
    auto missed = samples_with(context_, match, band.sample_count, is_missed);
    if (missed.empty()) return;
    std::vector<float> sheet_distances(band.sample_count);
    band.points.read(context_, sheet_distances, std::size_t{6} * band.capacity);
    std::erase_if(missed, [&](std::uint32_t i) { return !(sheet_distances[i] > 0); });
    if (!missed.empty()) search_extended_range(band, missed, sheet_distances, match);
  }

  bool needs_whole_texels() const override { return matcher_within_range_->needs_whole_texels(); }

 private:
  void search_extended_range(const TexelBand& band, const std::vector<std::uint32_t>& samples,
                             const std::vector<float>& sheet_distances,
                             DeviceCorrespondence& match) {
    const auto count = static_cast<std::uint32_t>(samples.size());
    const SamplePick pick(context_, samples);
    DeviceCorrespondence result(context_, count);
    rays_.intersect(pick.gather_points(band).points, count, count, query_, result);
    HostCorrespondence found(context_, result, count);
    for (std::uint32_t k = 0; k < count; ++k) {
      if (std::abs(found.distance[k]) > sheet_distances[samples[k]])
        found.triangle[k] = KILN_NO_TRIANGLE;
    }
    result.triangle.write(context_, std::span<const std::uint32_t>(found.triangle));
    pick.scatter_correspondence(result, match);
  }

  cl::Context& context_;
  const RaySearch& rays_;
  std::unique_ptr<Matcher> matcher_within_range_;
  RayQuery query_;
};

}  // namespace

std::unique_ptr<Matcher> make_extended_range_matcher(std::unique_ptr<Matcher> near_matcher,
                                                     const MatchRequest& request) {
  return std::make_unique<ExtendedRange>(std::move(near_matcher), request);
}

}  // namespace kiln
