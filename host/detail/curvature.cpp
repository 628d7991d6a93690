// How the high poly bends.
#include "mesh/curvature.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "detail/point_map.h"
#include "mesh/length.h"

namespace kiln {
namespace {

constexpr double kShare = 0.005;  // of the diagonal: the radius where none is given
// In the frame, where the mesh is about 1 across: what lies beyond is as good as these.
constexpr double kLeast = 1e-9, kMost = 16;

/// The mean curvature at the high poly's vertices, found when first needed, once for all maps of it.
class BendAtVertices : public SharedWork {
 public:
  explicit BendAtVertices(const MapRequest& request) : source_(request.source) {
    const Length radius = request.options.curvature_radius.value_or(Length::share(kShare));
    radius_ = std::clamp(to_frame(radius, source_.frame), kLeast, kMost);
  }

  void next_band() override {}
  void next_source() override { made_of_.reset(); }
  void find(std::uint64_t source_version) {
    if (made_of_ == source_version) return;
    at_vertex_ = mean_curvature(source_.positions, source_.triangles, radius_);
    made_of_ = source_version;
  }

  /// Interpolated, 1 / world unit.
  double at(const DensePoint& point) const {
    const Triangle& corners = source_.triangles[point.triangle];
    const double mean = at_vertex_[corners[0]] * (1.0 - point.u - point.v) +
                        at_vertex_[corners[1]] * point.u + at_vertex_[corners[2]] * point.v;
    return mean * source_.frame.scale;
  }

 private:
  const Source::Impl& source_;
  double radius_ = 0;
  std::vector<double> at_vertex_;  // in the frame
  std::optional<std::uint64_t> made_of_;
};

class Curvature : public PointFunction {
 public:
  /// \param apart  convex and concave in channels of their own
  Curvature(const MapRequest& request, bool apart)
      : bend_(request.shared.of<BendAtVertices>(request)), apart_(apart) {}

  void prepare(std::uint64_t source_version) override { bend_->find(source_version); }
  PointNeeds needs() const override {
    return {.position = false, .normal = false, .distance = false};
  }
  void operator()(const DensePoint& point, float* value) const override {
    if (!point.found) return;  // 0
    const auto bend = static_cast<float>(bend_->at(point));
    if (!apart_) {
      value[0] = bend;
      return;
    }
    value[0] = std::max(bend, 0.0F);
    value[1] = std::max(-bend, 0.0F);
    value[2] = std::abs(bend);  // a channel of nothing but 0 has no range for integer formats
  }

 private:
  std::shared_ptr<BendAtVertices> bend_;
  bool apart_;
};

MapRow bend_map(const MapInfo& info, bool apart) {
  MapRow row;
  row.info = info;
  row.info.takes_curvature_radius = true;
  row.follows_positions = true;
  row.unit = "1 / world unit";
  row.make = [info = row.info, apart](const MapRequest& request) {
    return make_point_map(
        request, info, std::unique_ptr<PointFunction>(std::make_unique<Curvature>(request, apart)));
  };
  return row;
}

}  // namespace

MapRow curvature_map() {
  MapRow row = bend_map({MapKind{"curvature"}, 1, MapType::signed_scalar,
                         "signed mean curvature of the high poly around the point, positive where "
                         "convex, 1 / world unit",
                         0, 0},
                        false);
  row.info.other_names = "cavity";
  return row;
}

MapRow convexity_map() {
  MapRow row =
      bend_map({MapKind{"convexity"}, 3, MapType::vector,
                "magnitude of that curvature: red where convex, green where concave, blue both, "
                "1 / world unit",
                0, 0},
               true);
  row.info.other_names = "concavity";
  return row;
}

}  // namespace kiln
