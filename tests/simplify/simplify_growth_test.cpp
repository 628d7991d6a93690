// simplify()'s cost, by the triangles and edges that it looks at: near linear, whatever the shape.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "kiln/simplify.h"
#include "mesh/surface_distance.h"
#include "simplify/collapse.h"
#include "support/crowded.h"
#include "support/shapes.h"

namespace kiln {
namespace {

struct Shape {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;
};

/// A disc: n triangles around one corner.
Shape fan(std::uint32_t n) {
  Shape shape;
  shape.points.push_back({0, 0, 0});
  for (std::uint32_t i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    shape.points.push_back({std::cos(angle) / 2, std::sin(angle) / 2, 0});
    shape.triangles.push_back({0, 1 + i, 1 + (i + 1) % n});
  }
  return shape;
}

/// A cone whose rim goes up and down, so that no two of its triangles lie in a plane.
Shape crown(std::uint32_t n) {
  Shape shape = fan(n);
  shape.points[0].z = 0.3;
  for (std::uint32_t i = 0; i < n; ++i) shape.points[1 + i].z = i % 2 == 0 ? 0.05 : -0.05;
  return shape;
}

/// Two cones, closed: every vertex of the rim is next to both tips.
Shape double_cone(std::uint32_t n) {
  Shape shape = fan(n);
  shape.points[0].z = 0.4;
  shape.points.push_back({0, 0, -0.4});
  for (std::uint32_t i = 0; i < n; ++i) {
    shape.triangles.push_back({n + 1, 1 + (i + 1) % n, 1 + i});
  }
  return shape;
}

/// Pages of a book: all on one edge.
Shape book(std::uint32_t n) {
  Shape shape;
  shape.points = {{0, 0, 0}, {0, 0, 0.5}};
  for (std::uint32_t i = 0; i < n / 2; ++i) {
    const double angle = 4 * std::numbers::pi * i / n;
    const double x = std::cos(angle) / 2, y = std::sin(angle) / 2;
    shape.points.push_back({x, y, 0});
    shape.points.push_back({x, y, 0.5});
    const std::uint32_t v = 2 + 2 * i;
    shape.triangles.push_back({0, v, v + 1});
    shape.triangles.push_back({0, v + 1, 1});
  }
  return shape;
}

/// Needles with one corner in common.
Shape needles(std::uint32_t n) {
  Shape shape;
  shape.points.push_back({0, 0, 0});
  for (std::uint32_t i = 0; i < n; ++i) {
    const double z = 2 * (i + 0.5) / n - 1, angle = 2.399963 * i, r = std::sqrt(1 - z * z);
    const Vec3d tip{r * std::cos(angle) / 2, r * std::sin(angle) / 2, z / 2};
    shape.points.push_back(tip);
    shape.points.push_back(tip + Vec3d{1e-3, 0, 1e-3});
    shape.triangles.push_back({0, 1 + 2 * i, 2 + 2 * i});
  }
  return shape;
}

/// A flat grid.
Shape grid(std::uint32_t n) {
  const auto side = static_cast<std::uint32_t>(std::sqrt(n / 2.0));
  const Mesh plane = test::plane(side, side);
  Shape shape;
  for (const Vec3& p : plane.positions) shape.points.push_back(to_double(p));
  shape.triangles = plane.triangles;
  return shape;
}

/// Tetrahedra apart from each other: nothing may go.
Shape parts(std::uint32_t n) {
  Shape shape;
  for (std::uint32_t i = 0; i < n / 4; ++i) {
    const double x = std::fmod(i * 0.7548776662, 1.0), y = std::fmod(i * 0.5698402910, 1.0);
    const auto first = static_cast<std::uint32_t>(shape.points.size());
    for (const Vec3d& d : {Vec3d{0, 0, 0}, Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
      shape.points.push_back(Vec3d{x, y, 0} + d * 1e-3);
    }
    for (const Triangle& t :
         {Triangle{0, 2, 1}, Triangle{0, 1, 3}, Triangle{1, 2, 3}, Triangle{2, 0, 3}}) {
      shape.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  return shape;
}

struct Outcome {
  double visits, faces;
};

Outcome collapse(const Shape& shape) {
  CollapseMesh mesh(shape.points, shape.triangles);
  EdgeCollapser collapser(mesh);
  collapser.run(64);
  return {static_cast<double>(mesh.visits), static_cast<double>(mesh.faces)};
}

struct Family {
  std::string name;
  Shape (*make)(std::uint32_t);
  bool shrinks;  ///< Down to the 64 faces asked for.
};

class SimplifyGrowth : public testing::TestWithParam<Family> {};

TEST_P(SimplifyGrowth, IsNearLinear) {
  constexpr std::uint32_t n = 1500, times = 8;
  const Outcome small = collapse(GetParam().make(n));
  const Outcome large = collapse(GetParam().make(n * times));
  const double power = std::log(large.visits / small.visits) / std::log(double{times});
  EXPECT_LT(power, 1.2) << small.visits << " to " << large.visits;
  EXPECT_GT(small.visits, n / 2.0);  // It did look.
  if (GetParam().shrinks) {
    EXPECT_LE(small.faces, 64);
    EXPECT_LE(large.faces, 64);
  }
}

INSTANTIATE_TEST_SUITE_P(Families, SimplifyGrowth,
                         testing::Values(Family{"fan", fan, true}, Family{"crown", crown, true},
                                         Family{"double_cone", double_cone, true},
                                         Family{"book", book, false},
                                         Family{"needles", needles, false},
                                         Family{"grid", grid, true}, Family{"parts", parts, false}),
                         [](const auto& info) { return info.param.name; });

using test::Soup;

TEST(SimplifyGrowth, TrianglesThatAreKeptAreMeasuredWithoutASearch) {
  for (const Soup& high :
       {test::shifted<Soup>(2000), test::turned<Soup>(2000), test::slivers<Soup>(2000)}) {
    // Every other triangle is kept, from its second corner on.
    std::vector<Triangle> kept;
    for (std::size_t t = 0; t < high.triangles.size(); t += 2) {
      const Triangle& c = high.triangles[t];
      kept.push_back({c[1], c[2], c[0]});
    }
    const SurfaceDistance all(high.positions, high.triangles), half(high.positions, kept);
    const DistanceReport whole = one_sided_distance(high.positions, high.triangles, all, 1 << 20);
    EXPECT_EQ(whole.samples, 8000U);
    EXPECT_EQ(whole.searched_count, 0U);
    EXPECT_LT(whole.largest, 1e-7);
    const DistanceReport some = one_sided_distance(high.positions, high.triangles, half, 1 << 20);
    EXPECT_EQ(some.searched_count, 4000U);
    double largest = 0;
    for (const Triangle& t : high.triangles) {
      for (const std::uint32_t v : t)
        largest = std::max(largest, std::sqrt(half.squared(high.positions[v])));
    }
    EXPECT_GT(largest, 0);
    EXPECT_NEAR(some.largest, largest, 1e-7);
  }
}

TEST(SurfaceDistanceGrowth, ATriangleTurnedRoundIsNotTheSame) {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Triangle> one{{0, 1, 2}}, turned{{0, 2, 1}};
  const SurfaceDistance light(corners, turned);
  const DistanceReport report = one_sided_distance(corners, one, light, 4);
  EXPECT_EQ(report.searched_count, 4U);
  EXPECT_EQ(report.largest, 0);
}

TEST(Simplify, WhichWayAClosedMeshFacesDoesNotCount) {
  // With hollows and rims: these weigh differently.
  Mesh right = test::BumpyTorus::dense(12000);
  right.normals.clear();
  right.normal_triangles.clear();
  Mesh turned = right;
  for (Triangle& t : turned.triangles) std::swap(t[1], t[2]);
  SimplifyOptions options;
  options.fit_normals = false;
  for (const std::uint32_t faces : {100U, 500U, 12000U}) {
    options.faces = faces;
    const Mesh one = simplify(right, options);
    Mesh other = simplify(turned, options);
    EXPECT_EQ(one.positions, other.positions);
    for (Triangle& t : other.triangles) std::swap(t[1], t[2]);
    EXPECT_EQ(one.triangles, other.triangles);
  }
}

}  // namespace
}  // namespace kiln
