// Flat charts by closed forms: what can be unrolled is unrolled, and what overlaps is seen.
#include "lowpoly/flat_chart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "lowpoly/chart_growth.h"
#include "lowpoly/flat_predicates.h"
#include "lowpoly/pairing.h"
#include "support/shapes.h"

namespace kiln {
namespace {

/// All inner edges glued: for sheets, which are discs as they are.
FlatChart sheet(const ChartSurface& surface) {
  std::vector<std::uint8_t> glued;
  std::vector<std::uint32_t> all, local(surface.triangles.size());
  for (const std::uint32_t mate : surface.mate) glued.push_back(mate != kNoIndex);
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) all.push_back(t);
  return cut_open(surface, all, glued, local);
}

/// A sheet bent by `bend(x, y)`, x from 0 to the width, y from 0 to the height.
template <typename Bend>
ChartSurface bent(std::uint32_t nx, std::uint32_t ny, double width, double height,
                  const Bend& bend) {
  Mesh mesh = test::plane(nx, ny, width, height);
  for (Vec3& p : mesh.positions) {
    p = to_float(bend(double{p.x} + 0.5 * width, double{p.y} + 0.5 * height));
  }
  return chart_surface(mesh);
}

TEST(FlatChart, ThreeQuartersOfACylinderUnroll) {
  const ChartSurface surface = bent(48, 6, 4.7, 1, [](double x, double y) {
    return Vec3d{std::cos(x), std::sin(x), y};
  });
  FlatChart chart = sheet(surface);
  project(chart, surface);
  EXPECT_FALSE(is_injective(chart));
  ASSERT_TRUE(conformal(chart));
  EXPECT_TRUE(is_injective(chart));
  EXPECT_LT(distortion(chart).energy, 1e-6);
  EXPECT_LT(distortion(chart).worst, 1.01);
}

TEST(FlatChart, ConformalMapsKeepAnglesOnASphere) {
  // A cap of the unit sphere: mean squared quasi-conformal error far below what a projection has.
  const ChartSurface surface = bent(16, 16, 1.6, 1.6, [](double x, double y) {
    const double u = x - 0.8, v = y - 0.8, r = std::hypot(u, v);
    const double s = r > 0 ? std::sin(r) / r : 1;
    return Vec3d{u * s, v * s, std::cos(r)};
  });
  FlatChart chart = sheet(surface);
  project(chart, surface);
  ASSERT_TRUE(conformal(chart));
  const double start = distortion(chart).energy;
  ASSERT_TRUE(is_injective(chart));
  double last = start;
  for (int round = 0; round < 4; ++round) {
    injective_rounds(chart, 1);
    EXPECT_TRUE(is_injective(chart));
    EXPECT_LE(distortion(chart).energy, last);
    last = distortion(chart).energy;
  }
  EXPECT_LT(last, 0.7 * start);
}

TEST(FlatChart, RoundsStopBeforeTheBorderMeetsItself) {
  // A ring of 350 degrees whose rest shape is a ring of 370: relaxed, its ends would overlap.
  constexpr double degree = std::numbers::pi / 180;
  // Along x round the ring, along y inward: counter-clockwise from above.
  const auto ring = [](const Vec3d& at, double angle) {
    const double radius = 3 - at.y;
    return FlatPoint{radius * std::cos(angle * at.x), radius * std::sin(angle * at.x)};
  };
  const ChartSurface surface = bent(60, 3, 1, 1, [&](double x, double y) {
    const FlatPoint p = ring({x, y, 0}, 370 * degree);
    return Vec3d{p.x, p.y, 0.4 * x};
  });
  // The unbent sheet: its vertices have the same numbers.
  const ChartSurface flat = bent(60, 3, 1, 1, [](double x, double y) { return Vec3d{x, y, 0}; });
  ASSERT_EQ(flat.triangles, surface.triangles);
  FlatChart chart = sheet(surface);
  for (std::size_t v = 0; v < chart.vertex.size(); ++v) {
    chart.points[v] = ring(flat.positions[chart.vertex[v]], 350 * degree);
  }
  ASSERT_TRUE(is_injective(chart));
  const double before = distortion(chart).energy;
  injective_rounds(chart, 8);
  EXPECT_TRUE(is_injective(chart));
  EXPECT_LT(distortion(chart).energy, before);
}

TEST(FlatChart, SimplePolygons) {
  const std::vector<FlatPoint> square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_TRUE(is_simple(square));
  EXPECT_FALSE(is_simple(std::vector<FlatPoint>{{0, 0}, {1, 1}, {1, 0}, {0, 1}}));
  EXPECT_FALSE(is_simple(std::vector<FlatPoint>{{0, 0}, {2, 0}, {1, 0}, {0, 1}})) << "folds back";
  EXPECT_FALSE(is_simple(std::vector<FlatPoint>{{0, 0}, {4, 0}, {4, 2}, {2, 0}, {0, 2}}))
      << "touches";
  EXPECT_TRUE(is_simple(std::vector<FlatPoint>{{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}}))
      << "straight";
}

TEST(FlatChart, GrownChartsOfASphereAreDiscsThatCoverIt) {
  const ChartSurface surface = chart_surface(test::icosphere(2));
  ChartBorders borders(surface);
  const std::vector<FlatChart> charts = grow_charts(surface, borders, {});
  std::vector<int> seen(surface.triangles.size(), 0);
  for (const FlatChart& chart : charts) {
    EXPECT_TRUE(is_injective(chart));
    EXPECT_LE(distortion(chart).energy, ChartLimits{}.energy);
    for (const std::uint32_t t : chart.source) ++seen[t];
    // Euler: a disc has V - E + F = 1, and E = (3 F + border) / 2.
    EXPECT_EQ(2 * chart.points.size() - chart.triangles.size() - chart.boundary.size(), 2u);
  }
  for (const int count : seen) EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace kiln
