// Rays along one axis, whatever the low poly's normals say: a decal, a relief, a planar projection.
#include "match/ray.h"
#include "match/views.h"

namespace kiln {
namespace {

class AxisMatcher : public Matcher {
 public:
  AxisMatcher(const MatchRequest& request, const Vec3d& axis)
      : context_(context_of(request.source.device)),
        rays_(request.source.rays()),
        query_(ray_query(request, false)),
        axis_(to_float(axis)) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    const std::size_t plane = band.capacity;
    std::vector<float> points = band.points.download(context_);
    for (std::size_t i = 0; i < band.sample_count; ++i) {
      float* x = &points[3 * plane + i];
      // Outward stays outward: the axis points to the side that the low poly faces.
      const float along = x[0] * axis_.x + x[plane] * axis_.y + x[2 * plane] * axis_.z;
      const float sign = along < 0 ? -1.0F : 1.0F;
      x[0] = sign * axis_.x;
      x[plane] = sign * axis_.y;
      x[2 * plane] = sign * axis_.z;
    }
    const cl::Array<float> turned(context_, std::span<const float>(points));
    rays_.intersect(turned, band.sample_count, band.capacity, query_, match);
    context_.finish();  // `turned` goes
  }

 private:
  cl::Context& context_;
  const RayCaster& rays_;
  RayQuery query_;
  Vec3 axis_;
};

}  // namespace

MatchRow axis_match() {
  MatchRow row;
  row.info.method = MatchMethod{"axis"};
  row.info.searches = "along one axis, both ways";
  row.info.options = "match.max_distance match.views.directions match.parts report.recall";
  row.follows_bvh = true;
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
