// How the high poly bends.
#include "mesh/curvature.h"

#include <algorithm>
#include <optional>

#include "detail/point_map.h"
#include "mesh/length.h"

namespace kiln {
namespace {

constexpr double kShare = 0.005;  // of the diagonal: the radius where none is given
// In the frame, where the mesh is about 1 across: what lies beyond is as good as these.
constexpr double kLeast = 1e-9, kMost = 16;

/// Interpolates the mean curvature at the high poly's vertices, which is found when first needed.
class Curvature : public PointFunction {
 public:
  Curvature(const Source::Impl& source, const Length& radius) : source_(source) {
    radius_ = std::clamp(to_frame(radius, source.frame), kLeast, kMost);
  }

  void prepare(std::uint64_t source_version) override {
    if (made_of_ == source_version) return;
    at_vertex_ = mean_curvature(source_.positions, source_.triangles, radius_);
    made_of_ = source_version;
  }

  PointNeeds needs() const override {
    return {.position = false, .normal = false, .distance = false};
  }
  void operator()(const DensePoint& point, float* value) const override {
    if (!point.found) return;  // 0
    const Triangle& corners = source_.triangles[point.triangle];
    const double mean = at_vertex_[corners[0]] * (1.0 - point.u - point.v) +
                        at_vertex_[corners[1]] * point.u + at_vertex_[corners[2]] * point.v;
    value[0] = static_cast<float>(mean * source_.frame.scale);
  }

 private:
  const Source::Impl& source_;
  double radius_ = 0;
  std::vector<double> at_vertex_;  // in the frame
  std::optional<std::uint64_t> made_of_;
};

}  // namespace

MapRow curvature_map() {
  MapRow row;
  row.info = {MapKind{"curvature"},
              1,
              MapType::signed_scalar,
              "signed mean curvature of the high poly around the point, positive where convex, 1 / "
              "world unit",
              0,
              0};
  row.info.takes_curvature_radius = true;
  row.follows_positions = true;
  row.unit = "1 / world unit";
  row.make = [](const MapRequest& request) {
    const Length radius = request.options.curvature_radius.value_or(Length::share(kShare));
    return make_point_map(
        request, curvature_map().info,
        std::unique_ptr<PointFunction>(std::make_unique<Curvature>(request.source, radius)));
  };
  return row;
}

}  // namespace kiln
