// Curvature of the high poly.
#include "mesh/curvature.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "detail/curvature_check.h"
#include "detail/point_map.h"
#include "detail/value_ranges.h"

namespace kiln {
namespace {

/// Mean curvature of the high poly, shared by all maps of a bake that need it.
class SharedCurvature : public SharedWork {
 public:
  struct Scratch : PointScratch {
    MeanCurvature::Scratch curvature;
    CurvatureCheck::Scratch check;
  };

  explicit SharedCurvature(const MapRequest& request)
      : source_(request.source),
        radius_option_(request.options.curvature_radius),
        uses_independent_check_(request.is_reference) {}

  void next_band() override {}
  void next_source() override { source_version_.reset(); }
  void find(std::uint64_t source_version) {
    if (source_version_ == source_version) return;
    radius_ = curvature_radius(radius_option_, source_);
    if (uses_independent_check_) {
      independent_check_.emplace(source_.positions, source_.triangles, radius_);
    } else {
      curvature_.emplace(source_.positions, source_.triangles, radius_);
    }
    source_version_ = source_version;
  }

  double radius() const { return radius_ / source_.frame.scale; }

  /// Mean curvature in 1 / world unit.
  double at(const HighPoint& point) const {
    auto& scratch = static_cast<Scratch&>(*point.scratch);
    const double bend =
        uses_independent_check_
            ? independent_check_->at(frame_position_of(point), point.triangle, scratch.check)
            : curvature_->on(point.triangle, point.u, point.v, scratch.curvature);
    return bend * source_.frame.scale;
  }

 private:
  /// The point's position in the frame.
  Vec3d frame_position_of(const HighPoint& point) const {
    const Triangle& t = source_.triangles[point.triangle];
    const double u = point.u, v = point.v;
    return to_double(source_.positions[t[0]]) * (1 - u - v) +
           to_double(source_.positions[t[1]]) * u + to_double(source_.positions[t[2]]) * v;
  }

  const Source::Impl& source_;
  std::optional<Length> radius_option_;
  double radius_ = 0;  // Radius of the averaging ball, in frame units
  bool uses_independent_check_;
  std::optional<CurvatureCheck>
      independent_check_;  // exactly one of independent_check_ and curvature_ is set
  std::optional<MeanCurvature> curvature_;  // In frame units
  std::optional<std::uint64_t> source_version_;
};

class Curvature : public PointFunction {
 public:
  /// \param separates_signs  true: convex and concave curvature are stored in separate channels
  Curvature(const MapRequest& request, bool separates_signs)
      : shared_curvature_(request.shared.of<SharedCurvature>(request)),
        separates_signs_(separates_signs) {}

  void prepare(std::uint64_t source_version) override { shared_curvature_->find(source_version); }
  PointNeeds needs() const override {
    return {.position = false, .normal = false, .distance = false};
  }
  std::unique_ptr<PointScratch> scratch() const override {
    return std::make_unique<SharedCurvature::Scratch>();
  }
  void report(BakedMap& map, std::vector<Warning>&) const override {
    map.curvature_radius = shared_curvature_->radius();
  }
  void operator()(const HighPoint& point, float* value) const override {
    if (!point.found) return;  // A missed sample keeps the value 0
    const auto bend = static_cast<float>(shared_curvature_->at(point));
    if (!separates_signs_) {
      value[0] = bend;
      return;
    }
    value[0] = std::max(bend, 0.0F);
    value[1] = std::max(-bend, 0.0F);
    value[2] = std::abs(bend);
  }

 private:
  std::shared_ptr<SharedCurvature> shared_curvature_;
  bool separates_signs_;
};

MapRow curvature_row(const MapInfo& info, bool separates_signs) {
  MapRow row;
  row.info = info;
  row.info.options = "curvature_radius";
  row.follows_positions = true;
  row.unit = "1 / world unit";
  row.make = [info = row.info, separates_signs](const MapRequest& request) {
    return make_point_map(
        request, info,
        std::unique_ptr<PointFunction>(std::make_unique<Curvature>(request, separates_signs)));
  };
  return row;
}

}  // namespace

MapRow curvature_map() {
  MapRow row =
      curvature_row({MapKind{"curvature"}, 1, MapType::signed_scalar,
                     "signed mean curvature of the high poly around the point, positive where "
                     "convex, 1 / world unit",
                     0, 0},
                    false);
  row.range = range_of_curvature_signed;
  row.info.other_names = "cavity";
  return row;
}

MapRow convexity_map() {
  MapRow row = curvature_row({MapKind{"convexity"}, 3, MapType::vector,
                              "magnitude of the mean curvature: red where convex, green where "
                              "concave, blue both, 1 / world unit",
                              0, 0},
                             true);
  row.range = range_of_curvature;
  row.compared_channels = 2;  // the third channel repeats the first two
  row.info.other_names = "concavity";
  return row;
}

}  // namespace kiln
