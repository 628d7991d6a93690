#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "kiln/limits.h"
#include "mesh/frame.h"
#include "mesh/normals.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"
#include "mesh/weld.h"
#include "support/shapes.h"

namespace kiln {
namespace {

TEST(Frame, HoldsTheMeshInAUnitBoxAtAnyScaleAndPlace) {
  for (const double scale : {1e-30, 1e-3, 1.0, 7.0, 1e30}) {
    for (const double offset : {0.0, 1e6}) {
      Mesh mesh = test::icosphere(2);
      for (Vec3& p : mesh.positions) {
        p = {static_cast<float>(p.x * scale), static_cast<float>(p.y * scale),
             static_cast<float>(p.z * scale)};
      }
      mesh.origin = {offset * scale, -offset * scale, 3 * offset * scale};
      const Frame frame = Frame::of(mesh);
      EXPECT_NEAR(frame.diagonal / scale, 2 * std::sqrt(3.0), 1e-5);
      EXPECT_GT(frame.diagonal * frame.scale, 0.5 - 1e-12);
      EXPECT_LE(frame.diagonal * frame.scale, 1.0);
      int exponent = 0;
      EXPECT_EQ(std::frexp(frame.scale, &exponent), 0.5) << "not a power of two";
      for (const Vec3& p : frame.to_frame(mesh)) {
        const double radius = length(to_double(p)) / (scale * frame.scale);
        EXPECT_NEAR(radius, 1, 1e-5);
      }
    }
  }
}

TEST(Frame, LeavesOutWhatIsNotFinite) {
  Mesh mesh = test::tetrahedron();
  const Frame expected = Frame::of(mesh);
  mesh.positions.push_back({NAN, 0, 0});
  mesh.positions.push_back({0, INFINITY, 0});
  mesh.positions.push_back({1e9F, 0, 0});  // no triangle uses this one
  mesh.triangles.push_back({0, 1, 4});
  mesh.triangles.push_back({0, 1, 5});
  const Frame frame = Frame::of(mesh);
  EXPECT_EQ(frame.center, expected.center);
  EXPECT_EQ(frame.scale, expected.scale);
}

TEST(Frame, RefusesAMeshWithoutExtent) {
  Mesh mesh = test::tetrahedron();
  for (Vec3& p : mesh.positions) p = {1, 2, 3};
  EXPECT_THROW(Frame::of(mesh), Error);
  for (Vec3& p : mesh.positions) p = {NAN, NAN, NAN};
  EXPECT_THROW(Frame::of(mesh), Error);
}

TEST(VertexNormals, PointOutOfASphereAndDoNotDependOnTheTriangulation) {
  const Mesh sphere = test::icosphere(4);
  const std::vector<Vec3> normals = vertex_normals(sphere.positions, sphere.triangles);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    EXPECT_GT(dot(to_double(normals[i]), to_double(sphere.positions[i])), 1 - 1e-5);
    EXPECT_NEAR(length(to_double(normals[i])), 1, 1e-6);
  }
  // At a cube's corner, whichever way its squares are split, angle weights give the space diagonal.
  const Mesh cube = test::cube(2);
  const std::vector<Vec3> corners = vertex_normals(cube.positions, cube.triangles);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    EXPECT_NEAR(dot(to_double(corners[i]), to_double(cube.positions[i])), std::sqrt(3.0), 1e-6);
  }
}

TEST(VertexNormals, IgnoreDegenerateAndNonFiniteTriangles) {
  Mesh mesh = test::icosphere(1);
  const std::vector<Vec3> expected = vertex_normals(mesh.positions, mesh.triangles);
  mesh.positions.push_back({NAN, 0, 0});
  const auto bad = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({0, 1, bad});
  const std::vector<Vec3> normals = vertex_normals(mesh.positions, mesh.triangles);
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(normals[i], expected[i]);
  EXPECT_EQ(normals[bad], (Vec3{0, 0, 1}));
}

TEST(CornerNormals, ReplaceZeroOnesAndKeepTheRest) {
  Mesh cube = test::cube();
  CornerNormals kept = corner_normals(cube, cube.positions);
  for (std::size_t i = 0; i < cube.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(kept.normals[kept.triangles[i][k]], cube.normals[cube.normal_triangles[i][k]]);
    }
  }
  cube.normals[cube.normal_triangles[0][0]] = {0, 0, 0};
  const CornerNormals mended = corner_normals(cube, cube.positions);
  const Vec3 normal = mended.normals[mended.triangles[0][0]];
  EXPECT_NEAR(length(to_double(normal)), 1, 1e-6);
}

TEST(ContinuousDirections, AreEqualWhereVerticesAreSplitAndAverageHardEdges) {
  // The cube with every triangle on vertices of its own, as an STL has it.
  const Mesh cube = test::cube(2);
  Mesh split;
  for (std::size_t i = 0; i < cube.triangles.size(); ++i) {
    Triangle corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = static_cast<std::uint32_t>(split.positions.size());
      split.positions.push_back(cube.positions[cube.triangles[i][k]]);
    }
    split.triangles.push_back(corners);
  }
  split.normals = cube.normals;
  split.normal_triangles = cube.normal_triangles;
  const std::vector<Vec3> directions = continuous_directions(
      split.positions, split.triangles, corner_normals(split, split.positions));
  for (std::size_t i = 0; i < directions.size(); ++i) {
    EXPECT_NEAR(dot(to_double(directions[i]), to_double(split.positions[i])), std::sqrt(3.0), 1e-5);
    for (std::size_t j = 0; j < i; ++j) {
      if (split.positions[i] == split.positions[j]) {
        EXPECT_EQ(directions[i], directions[j]);
      }
    }
  }
}

TEST(ContinuousDirections, ACardHasNoneUnlessItsNormalsAgree) {
  Mesh card;
  card.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  card.triangles = {{0, 1, 2}, {0, 2, 1}};
  card.normal_triangles = {{0, 0, 0}, {1, 1, 1}};
  const auto direction = [&](const Vec3& front, const Vec3& back) {
    card.normals = {front, back};
    return continuous_directions(card.positions, card.triangles,
                                 corner_normals(card, card.positions))[0];
  };
  // The sum of two sides that were fitted each by itself is no direction.
  EXPECT_EQ(direction({0, 0, 1}, {0.1F, 0, -0.995F}), Vec3{});
  EXPECT_EQ(direction({0, 0.2F, 0.98F}, {0, 0, -1}), Vec3{});
  // Foliage may have normals that all look up, on both sides.
  EXPECT_NEAR(direction({0, 0.8F, 0.6F}, {0, 0.8F, -0.6F}).y, 1, 1e-6);
}

TEST(WeldVertices, TreatsNegativeZeroAsZero) {
  const std::vector<Vec3> positions = {{0, 1, 2}, {5, 5, 5}, {-0.0F, 1, 2}, {0, 1, 2.0000002F}};
  EXPECT_EQ(weld_vertices(positions), (std::vector<std::uint32_t>{0, 1, 0, 3}));
}

TEST(WeldVertices, FindsTheFirstOfEachOnAnyNumberOfThreads) {
  std::vector<Vec3> positions;
  std::map<std::array<float, 3>, std::uint32_t> first;
  std::vector<std::uint32_t> expected;
  std::mt19937 random(3);
  for (std::uint32_t i = 0; i < 100'000; ++i) {
    const auto number = [&] { return static_cast<float>(random() % 32) - 16; };
    Vec3 p{number(), number(), number()};
    if (i % 1000 == 7) p.y = NAN;  // That is like no other.
    positions.push_back(p);
    expected.push_back(std::isnan(p.y) ? i : first.try_emplace({p.x, p.y, p.z}, i).first->second);
  }
  for (const int threads : {1, 3}) {
    set_thread_limit(threads);
    EXPECT_EQ(weld_vertices(positions), expected) << threads;
  }
  set_thread_limit(0);
}

/// Needles askew, whose boxes hold each other: the tree cuts them up, and finds what a look at all of them does.
TEST(SurfaceDistance, OfNeedlesIsThatOfTheNearest) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-1, 1);
  std::vector<Vec3> points;
  std::vector<Triangle> needles;
  const auto anywhere = [&](const Vec3& at, float reach) {
    return Vec3{at.x + reach * place(random), at.y + reach * place(random),
                at.z + reach * place(random)};
  };
  for (std::uint32_t i = 0; i < 400; ++i) {
    const Vec3 from = anywhere({}, 1), to = anywhere({}, 1);
    const float along = 0.5F + 0.5F * place(random);
    const Vec3 between{from.x + along * (to.x - from.x), from.y + along * (to.y - from.y),
                       from.z + along * (to.z - from.z)};
    points.insert(points.end(), {from, to, anywhere(between, 0.005F)});
    needles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  points.insert(points.end(), 3, Vec3{0.5F, 0.5F, 0.5F});  // One that is a point
  needles.push_back({1200, 1201, 1202});
  const SurfaceDistance tree(points, needles);
  const double endless = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 2000; ++i) {
    const Vec3 at = anywhere({}, 1.2F);
    double least = endless;
    for (std::size_t t = 0; t < needles.size(); ++t) {
      least = std::min(least, squared_distance_to_triangle(to_double(at), &points[3 * t], endless));
    }
    ASSERT_DOUBLE_EQ(tree.squared(at), least) << i;
    const std::uint32_t nearest = tree.nearest(at);
    ASSERT_LT(nearest, needles.size());
    ASSERT_DOUBLE_EQ(
        squared_distance_to_triangle(to_double(at), &points[std::size_t{3} * nearest], endless),
        least);
  }
}

/// Slivers near an axis, where coordinates tell less than rounding of a normal does: they are as far as their sides, so
/// that what is known of the distance never leads to another triangle.
/// Corners at heights 1, 2 and 6 over a plane, so that the centroid is at 3.
TEST(SurfaceDistance, StatisticsAreThoseOfAllSamples) {
  const std::vector<Vec3> plane{{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}};
  const SurfaceDistance low(plane, std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});
  const std::vector<Vec3> corners{{0, 0, 1}, {1, 0, 2}, {0, 1, -6}, {2, 2, 0}};
  const DistanceReport one =
      one_sided_distance(corners, std::vector<Triangle>{{0, 1, 2}}, low, 100);
  EXPECT_NEAR(one.largest, 6, 1e-6);
  EXPECT_NEAR(one.mean, (1 + 2 + 6 + 1) / 4.0, 1e-6);
  EXPECT_NEAR(one.root_mean_square, std::sqrt((1 + 4 + 36 + 1) / 4.0), 1e-6);
  // Of two triangles every other sample: corners 0 and 2 of each.
  const DistanceReport half =
      one_sided_distance(corners, std::vector<Triangle>{{0, 1, 2}, {0, 3, 1}}, low, 4);
  EXPECT_NEAR(half.largest, 6, 1e-6);
  EXPECT_NEAR(half.mean, (1 + 6 + 1 + 2) / 4.0, 1e-6);
}

TEST(SurfaceDistance, OfSliversIsThatOfTheirSides) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-1, 1);
  std::vector<Vec3> points;
  std::vector<Triangle> slivers;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const float end = place(random), thin = 1e-12F * std::pow(10.0F, 4 * place(random));
    points.insert(points.end(), {{0, 0, 0}, {end, 0, 0}, {end * place(random), thin, thin}});
    slivers.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const SurfaceDistance tree(points, slivers);
  const auto ends = std::minmax_element(points.begin(), points.end(),
                                        [](const Vec3& a, const Vec3& b) { return a.x < b.x; });
  for (int i = 0; i < 1000; ++i) {
    const Vec3 at{place(random), place(random), place(random)};
    const double along = std::clamp(at.x, ends.first->x, ends.second->x) - 1.0 * at.x;
    const double expected = along * along + 1.0 * at.y * at.y + 1.0 * at.z * at.z;
    EXPECT_NEAR(tree.squared(at), expected, 1e-7);
    const std::uint32_t nearest = tree.nearest(at);
    const double own = squared_distance_to_triangle(
        to_double(at), &points[std::size_t{3} * nearest], std::numeric_limits<double>::infinity());
    EXPECT_EQ(tree.nearest(at, own * (1 + 1e-9)), nearest);
  }
}

}  // namespace
}  // namespace kiln
