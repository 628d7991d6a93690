#include "stability/scenes.h"

#include <cmath>
#include <limits>
#include <utility>

#include "shared/common.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

using Height = std::function<double(double, double)>;

Mesh bare(Mesh mesh) {
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

/// A square of n by n cells over [-1/2, 1/2]^2, at heights.
Mesh patch(std::uint32_t n, const Height& height, double side = 1) {
  Mesh mesh = bare(plane(n, n, side, side));
  for (Vec3& p : mesh.positions) p.z = static_cast<float>(height(p.x, p.y));
  return mesh;
}

double waves(double x, double y) { return 0.005 * std::sin(25 * x) * std::cos(21 * y); }

Height lifted(double by) {
  return [by](double x, double y) { return by + waves(x, y); };
}

/// Triangles of b after those of a.
Mesh joined(Mesh a, const Mesh& b) {
  const auto first = static_cast<std::uint32_t>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const Triangle& t : b.triangles) {
    a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return a;
}

/// Every sample has a match, of a triangle below `good`.
auto of_triangles(std::size_t good) {
  return [good](double, double, std::uint32_t triangle, double) {
    if (triangle == KILN_NO_TRIANGLE) return Verdict::undecided;
    return triangle < good ? Verdict::right : Verdict::wrong;
  };
}

/// The plane bent along the middle of x by 90 degrees: two halves that fall away from (1) or rise towards
/// (-1) the viewer, moved out by `offset` along their normals.
Mesh roof(std::uint32_t n, double way, double offset, bool with_uvs) {
  Mesh mesh = plane(n, n);
  for (Vec3& p : mesh.positions) {
    const double along = std::abs(p.x) * std::sqrt(0.5);
    p.x = static_cast<float>(std::copysign(along, p.x));
    // Both halves' offsets meet in the middle plane.
    p.z = static_cast<float>(-way * along + offset * std::sqrt(2.0));
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return with_uvs ? mesh : bare(mesh);
}

FailureScene sheets() {
  FailureScene scene{
      "two close sheets",
      "A second sheet lies nearer, behind the one that is seen; right: the outer one.",
      patch(24, lifted(0.03)), plane(1, 1)};
  const std::size_t outer = scene.high.triangles.size();
  scene.high = joined(scene.high, patch(24, lifted(-0.012)));
  scene.judge = of_triangles(outer);
  return scene;
}

FailureScene convex_edge() {
  FailureScene scene{"convex edge", "A roof under a roof, folded by 90 degrees; right: any match.",
                     roof(24, 1, 0.04, false), roof(2, 1, 0, true)};
  scene.judge = of_triangles(scene.high.triangles.size());
  return scene;
}

FailureScene concave_corner() {
  FailureScene scene{"concave corner",
                     "A valley over a valley, folded by 90 degrees; right: any match.",
                     roof(24, -1, 0.04, false), roof(2, -1, 0, true)};
  scene.judge = of_triangles(scene.high.triangles.size());
  return scene;
}

/// A square shaft in the middle of the plane: its walls stand upright.
Mesh shaft(double half_width, double depth, double offset, bool with_uvs) {
  Mesh mesh = plane(5, 5);
  // Columns at -1/2, -w, -w, w, w, 1/2, where the doubled ones are the walls' upper and lower ends.
  const auto place = [&](double t) {
    const long column = std::lround((t + 0.5) * 5);
    constexpr double kSigns[] = {-1, -1, -1, 1, 1, 1};
    const double at = column == 0 || column == 5 ? 0.5 : half_width - offset;
    return kSigns[column] * at;
  };
  const auto inner = [](double t) {
    const long column = std::lround((t + 0.5) * 5);
    return column == 2 || column == 3;
  };
  for (Vec3& p : mesh.positions) {
    const bool low = inner(p.x) && inner(p.y);
    const double x = place(p.x), y = place(p.y);
    p = {static_cast<float>(x), static_cast<float>(y),
         static_cast<float>((low ? -depth : 0) + offset)};
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return with_uvs ? mesh : bare(mesh);
}

FailureScene deep_hole() {
  FailureScene scene{"deep hole",
                     "A shaft five times as deep as wide, within another; right: any match.",
                     shaft(0.06, 0.6, 0.004, false), shaft(0.06, 0.6, 0, true)};
  scene.reach = scene.cage = Length::absolute(0.02);
  scene.judge = of_triangles(scene.high.triangles.size());
  return scene;
}

FailureScene open_border() {
  FailureScene scene{"open border",
                     "The high poly ends before the low poly; right: matches where there is "
                     "something above, and none elsewhere.",
                     patch(24, lifted(0.02), 0.8), plane(1, 1)};
  scene.judge = [](double u, double v, std::uint32_t triangle, double) {
    const double beyond = std::max(std::abs(u - 0.5), std::abs(v - 0.5)) - 0.4;
    const bool found = triangle != KILN_NO_TRIANGLE;
    if (beyond > 0.002) return found ? Verdict::wrong : Verdict::right;
    if (beyond < -0.002) return found ? Verdict::right : Verdict::undecided;
    return Verdict::right;
  };
  return scene;
}

FailureScene hole() {
  FailureScene scene{
      "hole in the high poly",
      "A round hole, with another surface below, which is seen through it; right: that "
      "surface within the hole, and the upper one elsewhere.",
      patch(48, lifted(0.02)), plane(1, 1)};
  std::erase_if(scene.high.triangles, [&](const Triangle& t) {
    const Vec3& p = scene.high.positions[t[0]];
    return std::hypot(p.x, p.y) < 0.2;
  });
  const std::size_t upper = scene.high.triangles.size();
  scene.high = joined(scene.high, patch(24, lifted(-0.05)));
  scene.judge = [upper](double u, double v, std::uint32_t triangle, double) {
    if (triangle == KILN_NO_TRIANGLE) return Verdict::undecided;
    const double r = std::hypot(u - 0.5, v - 0.5);
    if (r < 0.17) return triangle >= upper ? Verdict::right : Verdict::wrong;
    if (r > 0.23) return triangle < upper ? Verdict::right : Verdict::wrong;
    return Verdict::right;
  };
  return scene;
}

FailureScene flipped_faces() {
  FailureScene scene{"flipped faces",
                     "Every fifth face of the high poly looks the wrong way; right: any match.",
                     patch(24, lifted(0.02)), plane(1, 1)};
  for (std::size_t t = 0; t < scene.high.triangles.size(); t += 5) {
    std::swap(scene.high.triangles[t][1], scene.high.triangles[t][2]);
  }
  scene.judge = of_triangles(scene.high.triangles.size());
  return scene;
}

FailureScene fans() {
  FailureScene scene{"non-manifold fans",
                     "Upright fins stand on the high poly's edges, four faces an edge; right: the "
                     "ground, seen from above.",
                     patch(24, lifted(0.02)), plane(1, 1)};
  const std::size_t ground = scene.high.triangles.size();
  Mesh& high = scene.high;
  for (std::uint32_t row = 2; row < 24; row += 4) {
    for (std::uint32_t column = 0; column < 24; ++column) {
      const std::uint32_t a = row * 25 + column, b = a + 1;
      const auto top = static_cast<std::uint32_t>(high.positions.size());
      for (const std::uint32_t v : {a, b}) {
        Vec3 p = high.positions[v];
        p.z += 0.03F;
        high.positions.push_back(p);
      }
      // Both sides.
      high.triangles.push_back({a, b, top + 1});
      high.triangles.push_back({a, top + 1, top});
      high.triangles.push_back({b, a, top});
      high.triangles.push_back({b, top, top + 1});
    }
  }
  scene.judge = of_triangles(ground);
  return scene;
}

FailureScene self_intersection() {
  const auto tilted = [](double slope) {
    return [slope](double x, double y) { return 0.03 + slope * x + waves(x, y); };
  };
  FailureScene scene{"self-intersection", "Two sheets cross; right: the upper one, which is seen.",
                     joined(patch(24, tilted(0.05)), patch(24, tilted(-0.05))), plane(1, 1)};
  const std::size_t half = scene.high.triangles.size() / 2;
  scene.judge = [half](double u, double, std::uint32_t triangle, double) {
    if (triangle == KILN_NO_TRIANGLE) return Verdict::undecided;
    if (std::abs(u - 0.5) < 0.02) return Verdict::right;
    return (triangle < half) == (u > 0.5) ? Verdict::right : Verdict::wrong;
  };
  return scene;
}

FailureScene slivers() {
  FailureScene scene{
      "slivers",
      "Triangles ten thousand times as long as wide; right: any match at the sheet's "
      "height.",
      {},
      plane(1, 1)};
  scene.high.name = "slivers";
  constexpr std::uint32_t kCount = 10000;
  for (std::uint32_t i = 0; i <= kCount; ++i) {
    const auto x = static_cast<float>(-0.5 + static_cast<double>(i) / kCount);
    scene.high.positions.push_back({x, -0.5F, 0.02F});
    scene.high.positions.push_back({x, 0.5F, 0.02F});
  }
  for (std::uint32_t i = 0; i < kCount; ++i) {
    scene.high.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
    scene.high.triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
  }
  scene.judge = [](double, double, std::uint32_t triangle, double distance) {
    if (triangle == KILN_NO_TRIANGLE) return Verdict::undecided;
    return std::abs(distance - 0.02) < 1e-4 ? Verdict::right : Verdict::wrong;
  };
  return scene;
}

FailureScene duplicates() {
  FailureScene scene{"duplicate faces",
                     "Every face of the high poly comes three times; right: its first copy.",
                     patch(24, lifted(0.02)), plane(1, 1)};
  const std::vector<Triangle> once = scene.high.triangles;
  for (int copy = 0; copy < 2; ++copy) {
    scene.high.triangles.insert(scene.high.triangles.end(), once.begin(), once.end());
  }
  scene.judge = of_triangles(once.size());
  return scene;
}

FailureScene coincident() {
  FailureScene scene{"coincident surfaces",
                     "Two flat sheets of other triangles lie in one place; right: either, at the "
                     "sheet's height.",
                     joined(patch(24, [](double, double) { return 0.02; }),
                            patch(17, [](double, double) { return 0.02; })),
                     plane(1, 1)};
  scene.judge = [](double, double, std::uint32_t triangle, double distance) {
    if (triangle == KILN_NO_TRIANGLE) return Verdict::undecided;
    return std::abs(distance - 0.02) < 1e-5 ? Verdict::right : Verdict::wrong;
  };
  return scene;
}

FailureScene far_away() {
  FailureScene scene{"low poly far from the dense one",
                     "The sheet is five times as far away as is looked; right: no match.",
                     patch(24, lifted(0.5)), plane(1, 1)};
  scene.judge = [](double, double, std::uint32_t triangle, double) {
    return triangle == KILN_NO_TRIANGLE ? Verdict::right : Verdict::wrong;
  };
  return scene;
}

FailureScene zero_normals() {
  FailureScene scene{"normals of zero length",
                     "Both meshes give normals without length; right: any match.",
                     patch(24, lifted(0.02)), plane(1, 1)};
  for (Mesh* mesh : {&scene.high, &scene.low}) {
    mesh->normals = {Vec3{}};
    mesh->normal_triangles.assign(mesh->triangles.size(), Triangle{0, 0, 0});
  }
  scene.judge = of_triangles(scene.high.triangles.size());
  return scene;
}

}  // namespace

std::vector<FailureScene> failure_scenes() {
  std::vector<FailureScene> scenes = {
      sheets(),     convex_edge(),   concave_corner(), deep_hole(),         open_border(),
      hole(),       flipped_faces(), fans(),           self_intersection(), slivers(),
      duplicates(), coincident(),    far_away(),       zero_normals()};
  for (FailureScene& scene : hard_failures()) scenes.push_back(std::move(scene));
  return scenes;
}

std::vector<Way> ways() {
  const auto way = [](const char* name, MatchMethod method) {
    Way result{name, {}};
    result.options.match.method = method;
    // A sheet that is seen from one side is no height field by name: views from all around.
    if (method == MatchMethod::views) result.options.match.views.count = 12;
    return result;
  };
  Way cage = way("ray, cage", MatchMethod::ray);
  cage.use_cage = true;
  Way two_sided = way("ray, two-sided", MatchMethod::ray);
  two_sided.options.match.two_sided = true;
  Way nearest = way("ray, nearest", MatchMethod::ray);
  nearest.options.match.ray.rule = RayRule::nearest;
  Way averaged = way("ray, averaged", MatchMethod::ray);
  averaged.options.match.ray.direction = RayDirection::averaged;
  Way parts = way("ray, by parts", MatchMethod::ray);
  parts.by_parts = true;
  return {way("ray", MatchMethod::ray),
          nearest,
          averaged,
          parts,
          cage,
          two_sided,
          way("closest", MatchMethod::closest),
          way("views", MatchMethod::views),
          way("visibility", MatchMethod::visibility),
          way("hybrid", MatchMethod::hybrid)};
}

}  // namespace kiln::test
