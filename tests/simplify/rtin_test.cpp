// Presimplification of height fields that are full grids.
#include "simplify/rtin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "simplify/heightfield_constraint.h"

namespace kiln {
namespace {

using Heights = std::function<double(double, double)>;

double waves(double x, double y) { return 0.05 * std::sin(9 * x * x) * std::cos(7 * y + 3 * x); }
double flat(double, double) { return 0.25; }

/// A grid over the unit square, its points and triangles in no order.
Work grid(std::uint32_t columns, std::uint32_t rows, bool uneven, const Heights& heights) {
  Work work;
  const auto spread = [uneven](double u) { return uneven ? u * (0.5 + 0.5 * u) : u; };
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      const double x = spread(i / (columns - 1.0)), y = spread(j / (rows - 1.0));
      work.points.push_back({x, y, heights(x, y)});
    }
  }
  for (std::uint32_t j = 0; j + 1 < rows; ++j) {
    for (std::uint32_t i = 0; i + 1 < columns; ++i) {
      const std::uint32_t a = j * columns + i, b = a + 1, c = b + columns, d = a + columns;
      work.triangles.push_back({a, b, c});
      work.triangles.push_back({a, c, d});
    }
  }
  std::mt19937 random(7);
  std::vector<std::uint32_t> order(work.points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), random);
  std::vector<Vec3d> points(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) points[order[i]] = work.points[i];
  work.points = points;
  for (Triangle& t : work.triangles) {
    for (std::uint32_t& v : t) v = order[v];
  }
  std::shuffle(work.triangles.begin(), work.triangles.end(), random);
  return work;
}

double area_from_above(const Work& work) {
  double area = 0;
  for (const Triangle& t : work.triangles) {
    const Vec3d &a = work.points[t[0]], &b = work.points[t[1]], &c = work.points[t[2]];
    area += ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
  }
  return area;
}

/// Sides that no other triangle has the other way round.
std::size_t open_sides(const Work& work) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Triangle& t : work.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  }
  std::size_t open = 0;
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    if (sides.contains({side.second, side.first})) continue;
    ++open;
    const Vec3d &a = work.points[side.first], &b = work.points[side.second];
    EXPECT_TRUE((a.x == b.x && (a.x == 0 || a.x == 1)) || (a.y == b.y && (a.y == 0 || a.y == 1)));
  }
  return open;
}

/// Largest vertical distance of the triangles' middles from the heights.
double largest_error(const Work& work, const Heights& heights) {
  double largest = 0;
  for (const Triangle& t : work.triangles) {
    const Vec3d m = (work.points[t[0]] + work.points[t[1]] + work.points[t[2]]) * (1.0 / 3);
    largest = std::max(largest, std::abs(m.z - heights(m.x, m.y)));
  }
  return largest;
}

constexpr double kAny = std::numeric_limits<double>::infinity();

TEST(GridStart, FillsTheRectangleFacingUp) {
  for (const auto& [columns, rows] : {std::pair{129U, 129U}, {200U, 130U}, {90U, 257U}, {2U, 2U}}) {
    for (const bool uneven : {false, true}) {
      Work work = grid(columns, rows, uneven, waves);
      const std::size_t dense = work.triangles.size();
      const std::size_t goal = std::max<std::size_t>(2, dense / 10);
      ASSERT_TRUE(simplify_to_rtin(work, goal, kAny));
      EXPECT_NEAR(area_from_above(work), 1, 1e-9);
      EXPECT_GE(open_sides(work), 4U);
      EXPECT_LE(work.triangles.size(), goal + 2);
      EXPECT_GE(work.triangles.size(), goal * 9 / 10);
      for (const Triangle& t : work.triangles) {
        EXPECT_GT(upward_quality(work.points[t[0]], work.points[t[1]], work.points[t[2]]), 0.01);
      }
      std::set<std::uint32_t> used;
      for (const Triangle& t : work.triangles) used.insert(t.begin(), t.end());
      EXPECT_EQ(used.size(), work.points.size());
    }
  }
}

TEST(GridStart, ReachesTheErrorWithFewTriangles) {
  for (const double error : {0.01, 0.001}) {
    Work work = grid(257, 257, false, waves);
    ASSERT_TRUE(simplify_to_rtin(work, 2, error));
    EXPECT_LT(largest_error(work, waves), 2 * error);
    EXPECT_LT(work.triangles.size(), 257U * 257 / 2);
    EXPECT_GT(work.triangles.size(), 100U);
  }
}

TEST(GridStart, TakesTwoTrianglesForAPlane) {
  Work work = grid(100, 70, false, flat);
  ASSERT_TRUE(simplify_to_rtin(work, 1000, kAny));
  EXPECT_EQ(work.triangles.size(), 2U);
}

TEST(GridStart, LeavesWhatIsNoGrid) {
  const auto refused = [](Work work) {
    const std::vector<Triangle> before = work.triangles;
    return !simplify_to_rtin(work, 100, kAny) && work.triangles == before;
  };
  Work hole = grid(40, 40, false, waves);
  hole.triangles.pop_back();
  EXPECT_TRUE(refused(hole));
  Work turned = grid(40, 40, false, waves);
  std::swap(turned.triangles[5][0], turned.triangles[5][1]);
  EXPECT_TRUE(refused(turned));
  Work moved = grid(40, 40, false, waves);
  moved.points[77].x += 1e-3;
  EXPECT_TRUE(refused(moved));
  EXPECT_TRUE(refused(grid(2000, 3, false, waves)));  // A square around it would be large.
}

}  // namespace
}  // namespace kiln
