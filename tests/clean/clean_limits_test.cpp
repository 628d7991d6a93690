// clean_mesh(): each documented limit, with a case on either side.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "clean/triangle_list.h"
#include "kiln/clean.h"
#include "mesh/weld.h"
#include "support/shapes.h"

namespace kiln {
namespace {

Mesh without(const Mesh& mesh, const auto& is_dropped) {
  std::vector<std::uint8_t> dropped(mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < dropped.size(); ++t) dropped[t] = is_dropped(t) ? 1 : 0;
  Mesh result = mesh;
  drop_triangles(result, dropped);
  return result;
}

Mesh inside_out(Mesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

Mesh moved(Mesh mesh, double x, double y, double z, double scale = 1) {
  for (Vec3& p : mesh.positions) {
    p = {static_cast<float>(scale * p.x + x), static_cast<float>(scale * p.y + y),
         static_cast<float>(scale * p.z + z)};
  }
  return mesh;
}

std::size_t open_edges(const Mesh& mesh) {
  return open_sides(welded_triangles(mesh), mesh.positions.size()).size();
}

/// A flat ring around a hole of n edges.
Mesh ring(std::uint32_t n, double hole) {
  Mesh mesh;
  mesh.name = "ring";
  for (const double radius : {hole, 1.0}) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n;
      mesh.positions.push_back({static_cast<float>(radius * std::cos(angle)),
                                static_cast<float>(radius * std::sin(angle)), 0});
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t k = (i + 1) % n;
    mesh.triangles.push_back({i, n + i, n + k});
    mesh.triangles.push_back({i, n + k, k});
  }
  return mesh;
}

TEST(CleanLimits, HolesOfTwelveEdgesAreFilledAndOfThirteenAreNot) {
  for (const std::uint32_t edges : {3U, 12U, 13U, 20U}) {
    Mesh mesh = ring(edges, 0.002);
    const CleanReport report = clean_mesh(mesh);
    const bool filled = edges <= 12;
    EXPECT_EQ(report.holes.count, filled ? 1U : 0U) << edges;
    EXPECT_EQ(open_edges(mesh), filled ? edges : 2 * edges);
  }
}

/// The ear with the shortest new edge is cut first: the patch of a rhombus is cut along its shorter diagonal.
TEST(CleanLimits, HolesAreCutAlongTheirShorterDiagonal) {
  for (const bool wide : {true, false}) {
    Mesh mesh = ring(4, 0.002);  // corners 0 and 2 lie along x, 1 and 3 along y
    for (Vec3& p : mesh.positions) (wide ? p.x : p.y) *= 1.3F;
    const std::size_t triangles = mesh.triangles.size();
    ASSERT_EQ(clean_mesh(mesh).holes.count, 1U);
    ASSERT_EQ(mesh.triangles.size(), triangles + 2);
    for (std::size_t t = triangles; t < mesh.triangles.size(); ++t) {
      const Triangle& corners = mesh.triangles[t];
      for (const std::uint32_t end : {wide ? 1U : 0U, wide ? 3U : 2U})
        EXPECT_NE(std::find(corners.begin(), corners.end(), end), corners.end()) << wide << t;
    }
  }
}

TEST(CleanLimits, HolesUpToThePerimeterAreFilled) {
  for (const double share : {0.9, 1.1}) {
    const std::uint32_t edges = 8;
    const double diagonal = 2 * std::sqrt(2.0), wanted = share * 0.02 * diagonal;
    Mesh mesh = ring(edges, wanted / (2 * edges * std::sin(std::numbers::pi / edges)));
    EXPECT_EQ(clean_mesh(mesh).holes.count, share < 1 ? 1U : 0U) << share;
  }
}

/// Holes that are 15% of what is left of a sheet are there on purpose.
TEST(CleanLimits, ASieveKeepsItsHoles) {
  constexpr std::size_t kSide = 20;
  for (const std::size_t holes : {52U, 53U}) {  // 52 of 348 cells are 14.9%, 53 of 347 are 15.3%
    std::size_t made = 0;
    std::vector<std::uint8_t> is_hole(kSide * kSide, 0);
    for (std::size_t y = 1; y + 1 < kSide; y += 2) {
      for (std::size_t x = 1; x + 1 < kSide && made < holes; x += 2, ++made)
        is_hole[y * kSide + x] = 1;
    }
    ASSERT_EQ(made, holes);
    Mesh mesh =
        without(test::plane(kSide, kSide), [&](std::size_t t) { return is_hole[t / 2] != 0; });
    const CleanReport report = clean_mesh(mesh, {.max_hole = 0.2});
    EXPECT_EQ(report.holes.count, holes == 52 ? 52U : 0U);
    EXPECT_EQ(open_edges(mesh), 4 * kSide + (holes == 52 ? 0 : 4 * holes));
  }
}

/// Small parts beside a box in each of the 26 directions, at a gap: all belong to its body where the gap is below half of
/// the share for floaters, whichever way the cells of the search lie; none does beyond twice that.
TEST(CleanLimits, GapsInAllDirectionsConnectABody) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> side(1, 2);
  for (int round = 0; round < 40; ++round) {
    const double size[3] = {side(random), side(random), side(random)};
    Mesh box = test::cube();
    Vec3 low = box.positions[0], high = low;
    for (const Vec3& p : box.positions) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    for (Vec3& p : box.positions) {
      p = {static_cast<float>(size[0] * (p.x - low.x) / (high.x - low.x)),
           static_cast<float>(size[1] * (p.y - low.y) / (high.y - low.y)),
           static_cast<float>(size[2] * (p.z - low.z) / (high.z - low.z))};
    }
    box.uvs.clear(), box.uv_triangles.clear(), box.normals.clear(), box.normal_triangles.clear();
    const double diagonal = std::hypot(size[0], size[1], size[2]), half_share = 0.005 * diagonal;
    for (const double gap : {0.95 * half_share, 2.5 * half_share}) {
      // What lies far off moves the cells' origin.
      std::vector<Mesh> meshes{box, moved(test::icosphere(1), -9 - side(random), -9 - side(random),
                                          -9 - side(random), 0.2)};
      for (int direction = 0; direction < 27; ++direction) {
        const int to[3] = {direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
        if (to[0] == 0 && to[1] == 0 && to[2] == 0) continue;
        const double steps = std::sqrt(std::abs(to[0]) + std::abs(to[1]) + std::abs(to[2]));
        // Beyond the box by the gap; far ones by it along each axis.
        const double reach = gap < half_share ? gap / steps : gap;
        const double small = 0.01 * half_share;
        double at[3];
        for (int k = 0; k < 3; ++k) {
          at[k] = to[k] == 0 ? 0.5 * size[k] : to[k] < 0 ? -reach : size[k] + reach;
        }
        meshes.push_back(moved(test::tetrahedron(), at[0], at[1], at[2], small));
      }
      Mesh mesh = join_meshes(meshes);
      const std::size_t given = mesh.triangles.size();
      const CleanReport report = clean_mesh(mesh, {.max_hole = 0, .keep_inner = true});
      EXPECT_EQ(report.floaters.count, gap < half_share ? 0U : 26U) << "round " << round;
      EXPECT_EQ(mesh.triangles.size(), gap < half_share ? given : given - 26 * 4);
    }
  }
}

/// Floaters are bodies: parts that lie close to each other are one.
TEST(CleanLimits, PartsOfAFloaterCountOnce) {
  const Mesh ball = test::icosphere(3), small = test::icosphere(1, 0.003);
  Mesh mesh = join_meshes(std::vector<Mesh>{ball, moved(small, 2, 0, 0), moved(small, 2.008, 0, 0),
                                            moved(small, -2, 0, 0)});
  EXPECT_EQ(clean_mesh(mesh).floaters.count, 2U);
  EXPECT_EQ(mesh.triangles.size(), ball.triangles.size());
}

/// Floaters of over a tenth of the area are there on purpose.
TEST(CleanLimits, ManyFloatersStay) {
  for (const int count : {50, 64}) {
    std::vector<Mesh> meshes{test::icosphere(3)};
    for (int i = 0; i < count; ++i) {  // on a circle around the ball
      const double angle = 2 * std::numbers::pi * i / count;
      meshes.push_back(
          moved(test::icosphere(1), 4 * std::cos(angle), 4 * std::sin(angle), 0, 0.045));
    }
    Mesh mesh = join_meshes(meshes);
    double all = 0, ball = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      all += area_of(mesh, mesh.triangles[t]);
      if (t < meshes[0].triangles.size()) ball = all;
    }
    ASSERT_EQ(1 - ball / all < 0.1, count == 50);
    ASSERT_NEAR(1 - ball / all, 0.1, 0.02);
    const CleanReport report = clean_mesh(mesh, {.floater = 0.05, .keep_inner = true});
    EXPECT_EQ(report.floaters.count, count == 50 ? 50U : 0U);
  }
}

/// A triangle that others adjoin in finer steps at two of its sides is cut at both.
TEST(CleanLimits, ATriangleIsCutAtEachOfItsSides) {
  for (const int turn : {0, 1, 2}) {
    Mesh mesh;
    const auto add = [&](const std::array<Vec3, 3>& corners, int first) {
      const auto v = static_cast<std::uint32_t>(mesh.positions.size());
      for (int k = 0; k < 3; ++k) mesh.positions.push_back(corners[(first + k) % 3]);
      mesh.triangles.push_back({v, v + 1, v + 2});
    };
    add({Vec3{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, turn);
    add({Vec3{0, 0, 0}, {1, -1, 0}, {1, 0, 0}}, 0);
    add({Vec3{1, 0, 0}, {1, -1, 0}, {2, 0, 0}}, 0);
    add({Vec3{0, 0, 0}, {0, 1, 0}, {-1, 1, 0}}, 0);
    add({Vec3{0, 1, 0}, {0, 2, 0}, {-1, 1, 0}}, 0);
    const CleanReport report = clean_mesh(mesh);
    EXPECT_EQ(report.junctions.count, 2U);
    EXPECT_EQ(mesh.triangles.size(), 7U);
    EXPECT_EQ(open_edges(mesh), 5U);
    double area = 0;
    for (const Triangle& t : mesh.triangles) area += area_of(mesh, t);
    EXPECT_NEAR(area, 4, 1e-6);
  }
}

/// Triangles of a part that were turned, where an outside-in ball with an opening stands beside a ball.
std::uint64_t turned_with_opening(double degrees) {
  const double lowest = std::cos(degrees * std::numbers::pi / 180);
  const Mesh ball = test::icosphere(4);
  const Mesh opened = without(ball, [&](std::size_t t) {
    double z = 0;
    for (const std::uint32_t v : ball.triangles[t]) z += ball.positions[v].z / 3.0;
    return z > lowest;
  });
  Mesh mesh =
      join_meshes(std::vector<Mesh>{moved(ball, 0, 0, 0, 2), moved(inside_out(opened), 6, 0, 0)});
  const std::size_t first = ball.triangles.size();
  const std::vector<Triangle> before = mesh.triangles;
  const CleanReport report = clean_mesh(mesh, {.max_hole = 0});
  EXPECT_EQ(report.inward.count, 0U);
  EXPECT_TRUE(std::equal(before.begin(), before.begin() + first, mesh.triangles.begin()));
  return report.turned.count == 0 ? 0 : report.turned.count == opened.triangles.size() ? 1 : 2;
}

/// Through an opening of half an angle a, views see the inner side of a sphere, in the mean as large as the opening's disc:
/// backs over fronts are 2 (1 + cos a) / sin(a)^2 at most, 17 at 28 degrees and 4 at 60. From 8 on the part is turned.
TEST(CleanLimits, APartOfSeveralThatFacesInwardsIsTurnedWhereItsBacksAreEightTimesAsSeen) {
  EXPECT_EQ(turned_with_opening(0), 1U);
  EXPECT_EQ(turned_with_opening(28), 1U);
  EXPECT_EQ(turned_with_opening(60), 0U);
  EXPECT_EQ(turned_with_opening(90), 0U);
}

}  // namespace
}  // namespace kiln
