// Rays along one axis, regardless of the low poly's normals: a decal, a relief, a planar
// projection.
#include "match/ray.h"
#include "match/views.h"

namespace kiln {
namespace {

class AxisMatcher : public Matcher {
 public:
  AxisMatcher(const MatchRequest& request, const Vec3d& axis)
      : context_(context_of(request.source.device)),
        rays_(request.source.ray_search()),
        query_(ray_query(request, false)),
        axis_(to_float(axis)) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    const std::size_t size = std::size_t{7} * band.capacity;
    if (axis_points_.size() < size) axis_points_ = cl::Array<float>(context_, size);
    // The axis is flipped so that it points to the side that the low poly faces: outward is then
    // its positive direction.
    context_.launch(context_.kernel("match", "kiln_match_set_axis"), band.sample_count, kLocal,
                    band.sample_count, band.capacity, axis_.x, axis_.y, axis_.z, band.points,
                    axis_points_);
    rays_.intersect(axis_points_, band.sample_count, band.capacity, query_, match);
  }

 private:
  cl::Context& context_;
  const RaySearch& rays_;
  RayQuery query_;
  Vec3 axis_;
  cl::Array<float> axis_points_;
};

}  // namespace

MatchRow axis_match() {
  MatchRow row;
  row.info.method = MatchMethod{"axis"};
  row.info.searches = "along one axis, both ways";
  row.info.options = "match.max_distance match.views.directions match.parts report.recall";
  row.is_refittable = row.supports_large_high_poly = true;
  row.make = [](const MatchRequest& request, MatchNotes&) -> std::unique_ptr<Matcher> {
    if (request.views.directions.size() != 1) {
      throw Error(ErrorCode::usage, "Matching along an axis needs one direction in views, but " +
                                        std::to_string(request.views.directions.size()) +
                                        " were given.");
    }
    return std::make_unique<AxisMatcher>(request, unit_direction(request.views.directions[0]));
  };
  return row;
}

}  // namespace kiln
