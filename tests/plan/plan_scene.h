// Pairs of meshes that are planned for, and what plans measure with.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "kiln/measure.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "measure/normal_probe.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test::plan_scene {

struct Pair {
  Mesh high = test::BumpySphere::dense(30000, true);
  Mesh low = test::BumpySphere::light(48, 24);
};

/// A sphere with waves that small maps are too coarse for.
struct Ripples {
  Mesh high = test::icosphere(6);
  Mesh low = test::uv_sphere(96, 48);

  Ripples() { bend(high); }
  static void bend(Mesh& mesh) {
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    for (Vec3& p : mesh.positions) {
      const float scale =
          1 + 0.002F * (std::sin(60 * p.x) + std::sin(60 * p.y) + std::sin(60 * p.z));
      p = {p.x * scale, p.y * scale, p.z * scale};
    }
  }
};

inline PlanOptions plan_options(double max_error, std::uint32_t size = 1024) {
  PlanOptions options;
  options.max_error = max_error;
  options.bake.width = options.bake.height = size;
  options.bake.match.max_distance = Length::share(0.05);
  return options;
}

/// Error as plans measure it, found in another way: every picture drawn.
class Pictures {
 public:
  explicit Pictures(const Mesh& high, std::uint32_t pixels)
      : box_(box_of(high)), reference_(Scene(*test::device(), high), box_, views(), pixels) {}

  double error(const Mesh& low, const Image& map) const {
    return reference_.compare(Scene(*test::device(), low, {&map})).mean_degrees;
  }
  double without_map(const Mesh& low, const Image& any) const {
    return reference_.compare(Scene(*test::device(), low, {&any}), true).mean_degrees;
  }

  static std::vector<ViewAngles> views() {
    std::vector<ViewAngles> result;
    for (const Vec3& toward : held_out_views(kPlanViews, spread_views(12))) {
      result.push_back(view_angles(toward));
    }
    return result;
  }

 private:
  /// Plans fit their pictures to it.
  static Mesh box_of(const Mesh& mesh) {
    Vec3 low = mesh.positions[0], high = low;
    for (const Vec3& p : mesh.positions) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    Mesh box = test::cube();
    for (Vec3& p : box.positions) {
      p = {p.x < 0 ? low.x : high.x, p.y < 0 ? low.y : high.y, p.z < 0 ? low.z : high.z};
    }
    return box;
  }

  Mesh box_;
  NormalReference reference_;
};

inline std::vector<MatchMethod> looked_at(const PlannedBake& planned) {
  std::vector<MatchMethod> methods;
  for (const PlanLimit& limit : planned.limits) methods.push_back(limit.method);
  return methods;
}

}  // namespace kiln::test::plan_scene
