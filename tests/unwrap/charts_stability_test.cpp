// Simplifying and laying out what is known to be hard: no crash, no flip, no overlap, bounds as stated.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "kiln/plan.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "support/shapes.h"
#include "unwrap/charts_check.h"

namespace kiln {
namespace {

/// Bounds for a shape.
struct Bounds {
  std::uint32_t faces = 400;
  double vertices = 2;    ///< After splitting, a position, at most
  double coverage = 0.3;  ///< Of the map, at least
  std::uint32_t size = 512;
  std::uint32_t border = 2;
};

/// Simplifies, lays out by charts, and holds the result against the exact oracle.
void expect_light(const Mesh& high, const Bounds& bounds) {
  SimplifyReport simplified;
  const Mesh low = simplify(high, {.faces = bounds.faces}, &simplified);
  EXPECT_EQ(simplified.folded, 0U);
  EXPECT_EQ(simplified.without_area, 0U);
  EXPECT_EQ(simplified.holes, 0U);
  UnwrapReport report;
  Mesh out;
  test::check_charts(low, {.size = bounds.size, .border_texels = bounds.border}, report, &out);
  EXPECT_EQ(report.border_texels, bounds.border);
  EXPECT_GE(report.coverage, bounds.coverage);
  EXPECT_LE(static_cast<double>(split_vertices(out)),
            bounds.vertices * static_cast<double>(out.positions.size()));
}

/// Repeatable numbers in [0, 1).
struct Random {
  std::uint64_t state = 88172645463325252U;
  double operator()() {
    state ^= state << 13U;
    state ^= state >> 7U;
    state ^= state << 17U;
    return static_cast<double>(state >> 11U) / 9007199254740992.0;
  }
};

void append(Mesh& mesh, const Mesh& part, const Vec3& at, float scale) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3& p : part.positions) {
    mesh.positions.push_back({p.x * scale + at.x, p.y * scale + at.y, p.z * scale + at.z});
  }
  for (const Triangle& t : part.triangles) {
    mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
}

/// A grid of heights over [0, 1]².
template <typename Height>
Mesh sheet(std::uint32_t side, const Height& height) {
  Mesh mesh;
  mesh.name = "sheet";
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x) {
      const double u = static_cast<double>(x) / side, v = static_cast<double>(y) / side;
      mesh.positions.push_back(
          {static_cast<float>(u), static_cast<float>(v), static_cast<float>(height(u, v))});
    }
  }
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t a = y * (side + 1) + x, b = a + side + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
  return mesh;
}

TEST(LightStability, ThinShells) {
  // Two spheres, a thousandth apart, the inner one turned inside out.
  Mesh mesh;
  mesh.name = "shell";
  const Mesh ball = test::icosphere(4);
  append(mesh, ball, {0, 0, 0}, 1);
  Mesh inner = ball;
  for (Triangle& t : inner.triangles) std::swap(t[1], t[2]);
  append(mesh, inner, {0, 0, 0}, 0.999F);
  expect_light(mesh, {.faces = 600});
}

TEST(LightStability, Needles) {
  // A tube a thousand times as long as wide.
  Mesh mesh = test::uv_sphere(12, 60);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  for (Vec3& p : mesh.positions) p.y *= 1000;
  expect_light(mesh, {.faces = 300, .vertices = 4, .coverage = 0});
}

TEST(LightStability, SurfacesThatTouchThemselves) {
  // Balls that share a point each with the next.
  Mesh mesh;
  mesh.name = "beads";
  const Mesh ball = test::uv_sphere(24, 16);
  for (int i = 0; i < 5; ++i) append(mesh, ball, {0, 2.0F * static_cast<float>(i), 0}, 1);
  expect_light(mesh, {.faces = 800});
}

TEST(LightStability, ManyTinyParts) {
  Mesh mesh;
  mesh.name = "parts";
  Random random;
  const Mesh part = test::tetrahedron();
  for (int i = 0; i < 10000; ++i) {
    const Vec3 at{static_cast<float>(100 * random()), static_cast<float>(100 * random()),
                  static_cast<float>(100 * random())};
    append(mesh, part, at, 0.2F);
  }
  // None may vanish, so all faces stay.
  expect_light(mesh, {.faces = 40000, .vertices = 3, .coverage = 0.1, .size = 4096, .border = 1});
}

TEST(LightStability, FlatAreasWithSmallDetail) {
  expect_light(sheet(120,
                     [](double u, double v) {
                       const double x = u - 0.5, y = v - 0.5;
                       return 0.002 * std::exp(-20000 * (x * x + y * y));
                     }),
               {.faces = 200, .vertices = 1.5, .coverage = 0.5});
}

TEST(LightStability, NoisyOpenScans) {
  Random random;
  expect_light(sheet(70,
                     [&](double u, double v) {
                       return 0.1 * std::sin(5 * u) * std::cos(4 * v) + 0.01 * random();
                     }),
               {.faces = 500, .vertices = 2});
}

TEST(LightStability, SoupsThatAreNoManifold) {
  // Random triangles over few vertices: edges with many triangles, both senses, repeats.
  Random random;
  Mesh mesh;
  mesh.name = "soup";
  for (int i = 0; i < 30; ++i) {
    mesh.positions.push_back(
        {static_cast<float>(random()), static_cast<float>(random()), static_cast<float>(random())});
  }
  const auto corner = [&] { return static_cast<std::uint32_t>(30 * random()); };
  while (mesh.triangles.size() < 100) {
    const Triangle t{corner(), corner(), corner()};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  UnwrapReport report;
  Mesh out;
  test::check_charts(mesh, {.size = 1024}, report, &out);
  EXPECT_EQ(report.border_texels, 2);
  EXPECT_GE(report.coverage, 0.3);
  SimplifyReport simplified;
  const Mesh low = simplify(mesh, {.faces = 60}, &simplified);
  EXPECT_EQ(simplified.without_area, 0U);
  test::check_charts(low, {.size = 1024}, report, &out);
}

}  // namespace
}  // namespace kiln
