// unwrap() over random meshes: no overlap, borders kept, nothing lost, same answer twice.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>

#include "kiln/unwrap.h"
#include "reference/layout.h"

namespace kiln {
namespace {

/// Corners on a coarse lattice, so that edges are shared, triangles coincide and some have no area.
Mesh random_mesh() {
  const auto coordinate = [] { return static_cast<float>(*rc::gen::inRange(0, 4)); };
  Mesh mesh;
  mesh.name = "random";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};  // Something to unwrap, whatever follows.
  const int vertices = *rc::gen::inRange(3, 24);
  for (int i = 3; i < vertices; ++i) {
    const float x = coordinate(), y = coordinate(), z = coordinate();
    mesh.positions.push_back({x, y, z});
  }
  const int triangles = *rc::gen::inRange(1, 60);
  for (int i = 0; i < triangles; ++i) {
    const auto vertex = [&] { return static_cast<std::uint32_t>(*rc::gen::inRange(0, vertices)); };
    const std::uint32_t a = vertex(), b = vertex(), c = vertex();
    mesh.triangles.push_back({a, b, c});
  }
  return mesh;
}

bool has_area(const Mesh& mesh, const Triangle& t) {
  const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
  const float x = (b.y - a.y) * (c.z - a.z) - (b.z - a.z) * (c.y - a.y);
  const float y = (b.z - a.z) * (c.x - a.x) - (b.x - a.x) * (c.z - a.z);
  const float z = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  return x != 0 || y != 0 || z != 0;  // Exact on the lattice.
}

TEST(UnwrapProperty, AnyMeshGivesAValidLayout) {
  const bool passed = rc::check([] {
    const Mesh mesh = random_mesh();
    const auto usable = static_cast<std::uint64_t>(
        std::count_if(mesh.triangles.begin(), mesh.triangles.end(),
                      [&](const Triangle& t) { return has_area(mesh, t); }));
    const UnwrapOptions options{
        .method = UnwrapMethod::pairs,
        .size = static_cast<std::uint32_t>(*rc::gen::inRange(16, 300)),
        .border_texels = static_cast<std::uint32_t>(*rc::gen::inRange(1, 5))};
    UnwrapReport report;
    const Mesh out = unwrap(mesh, options, &report);
    const double finer = std::max(1.0, 1 / report.border_texels);
    const auto grid = static_cast<std::int64_t>(std::lround(options.size * finer));
    const auto border = static_cast<std::int64_t>(std::lround(report.border_texels * finer));
    const test::LayoutFacts facts = test::check_layout(out, grid, border, options.size);
    RC_ASSERT(facts.first_fault == "");
    RC_ASSERT(facts.charts == report.charts);
    RC_ASSERT(facts.collapsed == mesh.triangles.size() - usable);
    RC_ASSERT(unwrap(mesh, options).uvs == out.uvs);
  });
  EXPECT_TRUE(passed);
}

}  // namespace
}  // namespace kiln
