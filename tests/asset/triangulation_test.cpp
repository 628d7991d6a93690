// Polygons cut as other programs cut them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/polygon.h"
#include "support/environment.h"

namespace kiln {
namespace {

using Corners = std::vector<std::array<double, 3>>;
using Triples = std::vector<std::array<std::uint32_t, 3>>;

Triples cut(const Corners& corners, Triangulation rule) {
  Triples triangles;
  triangulate(corners, rule, triangles);
  return triangles;
}

/// The fixture is what Blender 5.0.1 itself gives: tools/bench/blender_triangles.py.
TEST(Triangulation, IsBlendersToTheTriangle) {
  std::ifstream in(test::test_data("blender_triangles.txt"));
  ASSERT_TRUE(in);
  std::size_t quads = 0, larger = 0, folded = 0, other_than_ours = 0;
  for (std::string line; std::getline(in, line);) {
    if (line[0] == '#') continue;
    std::istringstream numbers(line);
    std::size_t count = 0;
    numbers >> count;
    Corners corners(count);
    for (auto& corner : corners) {
      for (double& value : corner) numbers >> value;
    }
    Triples wanted(count - 2);
    for (auto& triangle : wanted) {
      for (std::uint32_t& corner : triangle) numbers >> corner;
    }
    ASSERT_TRUE(numbers) << line;
    EXPECT_EQ(cut(corners, Triangulation::blender), wanted) << line;
    ++(count == 4 ? quads : larger);
    if (count == 4 && wanted[0] == std::array<std::uint32_t, 3>{0, 1, 3}) ++folded;
    if (cut(corners, Triangulation::automatic) != wanted) ++other_than_ours;
  }
  EXPECT_GT(quads, 100U);
  EXPECT_GT(larger, 150U);
  EXPECT_GT(folded, 10U);
  // Else the rule would be no rule of its own.
  EXPECT_GT(other_than_ours, 100U);
}

TEST(Triangulation, OfQuads) {
  const Triples along_0_2 = {{0, 1, 2}, {0, 2, 3}}, along_1_3 = {{0, 1, 3}, {1, 2, 3}};
  const Corners kite = {{0, 0, 0}, {2, -1, 0}, {6, 0, 0}, {2, 1, 0}};  // 1 and 3 are nearer
  EXPECT_EQ(cut(kite, Triangulation::shortest), along_1_3);
  EXPECT_EQ(cut(kite, Triangulation::blender), along_0_2);
  EXPECT_EQ(cut(kite, Triangulation::fan), along_0_2);
  const Corners square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(cut(square, Triangulation::shortest), along_0_2);
  // A dart folds along 0 and 2, whose way is the shorter one, too.
  const Corners dart = {{0, 0, 0}, {-1, -1, 0}, {3, 0, 0}, {-1, 1, 0}};
  EXPECT_EQ(cut(dart, Triangulation::shortest), along_0_2);
  const Corners turned = {{-1, -1, 0}, {3, 0, 0}, {-1, 1, 0}, {0, 0, 0}};
  EXPECT_EQ(cut(turned, Triangulation::shortest), along_1_3);
  EXPECT_EQ(cut(turned, Triangulation::blender), along_1_3);
  EXPECT_EQ(cut(turned, Triangulation::fan), along_0_2);
}

/// Against all triangulations of a convex polygon there is no proof of least length, but each cut is the
/// shortest that is left, and areas add up.
TEST(Triangulation, TakesTheShortestCutFirst) {
  const Corners long_hexagon = {{0, 0, 0}, {4, 0, 0}, {5, 1, 0}, {4, 2, 0}, {0, 2, 0}, {-1, 1, 0}};
  EXPECT_EQ(cut(long_hexagon, Triangulation::shortest),
            (Triples{{1, 2, 3}, {4, 5, 0}, {4, 0, 1}, {1, 3, 4}}));
  const Corners notched = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 0.5, 0}, {0, 4, 0}};
  for (const Triangulation rule : {Triangulation::shortest, Triangulation::blender}) {
    double area = 0;
    for (const auto& [a, b, c] : cut(notched, rule)) {
      const auto &p = notched[a], &q = notched[b], &r = notched[c];
      const double own = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
      EXPECT_GT(own, 0);
      area += own / 2;
    }
    EXPECT_NEAR(area, 9, 1e-12);  // 16 less the notch of 4 x 3.5 / 2
  }
}

/// Readers warn of polygons that no rule could cut by ears.
TEST(Triangulation, SaysWhetherEarsWereEnough) {
  const Corners hexagon = {{0, 0, 0}, {4, 0, 0}, {5, 1, 0}, {4, 2, 0}, {0, 2, 0}, {-1, 1, 0}};
  const Corners line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  for (const Triangulation rule :
       {Triangulation::automatic, Triangulation::shortest, Triangulation::fan}) {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    EXPECT_TRUE(triangulate(hexagon, rule, triangles));
    EXPECT_EQ(triangles.size(), 4U);
    EXPECT_EQ(triangulate(line, rule, triangles), rule == Triangulation::fan);
    EXPECT_EQ(triangles.size(), 3U);
  }
}

TEST(Triangulation, IsTakenByTheReader) {
  const std::filesystem::path file = test::scratch_folder() / "kite.obj";
  std::ofstream(file) << "v 0 0 0\nv 2 -1 0\nv 6 0 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                         "f 1/1 2/2 3/3 4/4\n";
  const Mesh mesh = load_mesh(file, {.triangulation = Triangulation::shortest});
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 3}, {1, 2, 3}}));
  EXPECT_EQ(mesh.uv_triangles, mesh.triangles);
  EXPECT_EQ(load_mesh(file).triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

// A fan's needles lie one on the other, and no tree takes them apart: a disc of a million corners was matched in
// linear time a ray. Halves overlap by the depth alone.
TEST(Triangulation, OfLargeConvexPolygonsHardlyOverlaps) {
  constexpr std::uint32_t kCorners = 5000, kPoints = 200;
  constexpr double kTurn = 6.283185307179586;
  Corners corners;
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    corners.push_back({std::cos(kTurn * i / kCorners), std::sin(kTurn * i / kCorners), 0});
  }
  const Triples triangles = cut(corners, Triangulation::automatic);
  ASSERT_EQ(triangles.size(), kCorners - 2);
  double area = 0;
  std::size_t boxes = 0;
  for (const auto& t : triangles) {
    const auto& [a, b, c] = t;
    const double twice = (corners[b][0] - corners[a][0]) * (corners[c][1] - corners[a][1]) -
                         (corners[b][1] - corners[a][1]) * (corners[c][0] - corners[a][0]);
    EXPECT_GT(twice, 0);
    area += twice / 2;
    for (std::uint32_t i = 0; i < kPoints; ++i) {
      const double angle = 2.399963 * i, r = std::sqrt((i + 0.5) / kPoints);
      const double at[] = {r * std::cos(angle), r * std::sin(angle)};
      bool within = true;
      for (std::size_t k = 0; k < 2; ++k) {
        const auto [low, high] = std::minmax({corners[a][k], corners[b][k], corners[c][k]});
        within = within && low <= at[k] && at[k] <= high;
      }
      boxes += within ? 1 : 0;
    }
  }
  EXPECT_NEAR(area, kCorners * std::sin(kTurn / kCorners) / 2, 1e-9);
  EXPECT_LE(boxes, 20 * kPoints);  // the fan: 1,000 a point
}

}  // namespace
}  // namespace kiln
