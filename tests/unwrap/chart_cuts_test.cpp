// Cuts of flat charts: limbs come off, what is compact stays whole, and every part is a disc.
#include "unwrap/chart_cuts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include "support/shapes.h"
#include "unwrap/chart_growth.h"
#include "unwrap/flat_predicates.h"

namespace kiln {
namespace {

/// The cells of a 24 x 24 sheet of side 1 where `inside(x, y)`, laid flat as one chart.
struct AtlasBitmap {
  ChartSurface surface;
  ChartBorders borders;
  std::vector<FlatChart> charts;

  explicit AtlasBitmap(const std::function<bool(double, double)>& inside)
      : surface(chart_surface(cells(inside))), borders(surface) {
    charts = grow_charts(surface, borders, {});
  }

  static Mesh cells(const std::function<bool(double, double)>& inside) {
    Mesh mesh = test::plane(24, 24, 1, 1);
    std::vector<Triangle> kept;
    for (std::size_t t = 0; t + 1 < mesh.triangles.size(); t += 2) {
      const Vec3 &a = mesh.positions[mesh.triangles[t][0]],
                 &c = mesh.positions[mesh.triangles[t][2]];
      if (!inside(0.5 * (double{a.x} + c.x) + 0.5, 0.5 * (double{a.y} + c.y) + 0.5)) continue;
      kept.push_back(mesh.triangles[t]);
      kept.push_back(mesh.triangles[t + 1]);
    }
    mesh.triangles = kept;
    mesh.uvs.clear();
    mesh.uv_triangles.clear();
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    return mesh;
  }

  void cut(double seam, int threads = 1) {
    const double extent = std::sqrt(surface.total_area);
    const CutPrice price{0.001 * extent, seam * extent};
    CutCharts result = cut_charts(surface, borders, std::span(&price, 1), charts, threads)[0];
    borders.restore(std::move(result.glued));
    charts = std::move(result.charts);
    std::vector<int> seen(surface.triangles.size(), 0);
    for (const FlatChart& chart : charts) {
      EXPECT_TRUE(is_injective(chart));
      EXPECT_EQ(2 * chart.points.size(), 2 + chart.triangles.size() + chart.boundary.size());
      for (const std::uint32_t t : chart.source) ++seen[t];
    }
    for (const int count : seen) EXPECT_EQ(count, 1);
  }
};

bool cross_shape(double x, double y) { return std::abs(x - 0.5) < 0.1 || std::abs(y - 0.5) < 0.1; }

TEST(ChartCuts, ASquareStaysWhole) {
  AtlasBitmap sheet([](double, double) { return true; });
  ASSERT_EQ(sheet.charts.size(), 1u);
  sheet.cut(0.001);
  EXPECT_EQ(sheet.charts.size(), 1u);
}

TEST(ChartCuts, ACrossIsCutIntoBars) {
  AtlasBitmap sheet(cross_shape);
  ASSERT_EQ(sheet.charts.size(), 1u);
  sheet.cut(0.02);
  // Two arms come off one bar, or all four off the middle or three; each chart fills its box.
  EXPECT_GE(sheet.charts.size(), 3u);
  EXPECT_LE(sheet.charts.size(), 5u);
  for (const FlatChart& chart : sheet.charts) {
    double left = 1e9, right = -1e9, low = 1e9, high = -1e9, area = 0;
    for (const RestShape& rest : chart.rest) area += rest.area;
    // Laid out flat, but turned: the box along its longest border edge's direction.
    const Vec2d &a = chart.points[chart.boundary[0]], &b = chart.points[chart.boundary[1]];
    const Vec2d u = (b - a) * (1 / std::sqrt(dot(b - a, b - a)));
    for (const Vec2d& p : chart.points) {
      left = std::min(left, dot(p, u)), right = std::max(right, dot(p, u));
      low = std::min(low, cross(u, p)), high = std::max(high, cross(u, p));
    }
    EXPECT_GT(area, 0.95 * (right - left) * (high - low));
  }
}

TEST(ChartCuts, WhatCostsTooMuchIsNotCut) {
  AtlasBitmap sheet(cross_shape);
  sheet.cut(100);
  EXPECT_EQ(sheet.charts.size(), 1u);
}

TEST(ChartCuts, ThreadsChangeNothing) {
  const ChartSurface surface = chart_surface(test::BumpySphere::dense(1500));
  std::vector<std::vector<Vec2d>> first;
  for (const int threads : {1, 2, 5}) {
    ChartBorders borders(surface);
    std::vector<FlatChart> charts = grow_charts(surface, borders, {});
    const CutPrice price{0.001, 0.01};
    charts = cut_charts(surface, borders, std::span(&price, 1), charts, threads)[0].charts;
    std::vector<std::vector<Vec2d>> points;
    for (const FlatChart& chart : charts) points.push_back(chart.points);
    if (first.empty()) first = points;
    ASSERT_EQ(points.size(), first.size());
    for (std::size_t c = 0; c < points.size(); ++c) {
      ASSERT_EQ(points[c].size(), first[c].size());
      for (std::size_t v = 0; v < points[c].size(); ++v) {
        ASSERT_EQ(points[c][v].x, first[c][v].x);
        ASSERT_EQ(points[c][v].y, first[c][v].y);
      }
    }
  }
}

/// Each price comes to what it comes to alone, though parts are looked at once for all.
TEST(ChartCuts, SeveralPricesAreAsEachAlone) {
  for (const std::uint32_t faces : {300U, 1500U, 4000U}) {
    const ChartSurface surface = chart_surface(test::BumpySphere::dense(faces));
    ChartBorders borders(surface);
    const std::vector<FlatChart> charts = grow_charts(surface, borders, {});
    const std::vector<std::uint8_t> glued = borders.glued();
    const std::vector<CutPrice> prices{{0.001, 0.05}, {0.001, 0.01},  {0.001, 0.01, 0.3},
                                       {0.001, 0.05}, {0.001, 0.002}, {0.1, 9}};
    const std::vector<CutCharts> all = cut_charts(surface, borders, prices, charts, 2);
    ASSERT_EQ(all.size(), prices.size());
    EXPECT_EQ(borders.glued(), glued);
    EXPECT_EQ(all.back().charts.size(), charts.size());
    EXPECT_GT(all[4].charts.size(), charts.size());
    for (std::size_t p = 0; p < prices.size(); ++p) {
      const CutCharts alone = cut_charts(surface, borders, std::span(&prices[p], 1), charts, 1)[0];
      EXPECT_EQ(alone.glued, all[p].glued);
      ASSERT_EQ(alone.charts.size(), all[p].charts.size());
      std::vector<int> seen(surface.triangles.size(), 0);
      for (std::size_t c = 0; c < alone.charts.size(); ++c) {
        EXPECT_EQ(alone.charts[c].source, all[p].charts[c].source);
        EXPECT_TRUE(is_injective(all[p].charts[c]));
        for (const std::uint32_t t : all[p].charts[c].source) ++seen[t];
      }
      for (const int count : seen) EXPECT_EQ(count, 1);
      // Glued edges lie inside of one chart.
      std::vector<std::size_t> owner(surface.triangles.size());
      for (std::size_t c = 0; c < all[p].charts.size(); ++c) {
        for (const std::uint32_t t : all[p].charts[c].source) owner[t] = c;
      }
      for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
        if (all[p].glued[h] == 0) continue;
        ASSERT_EQ(owner[h / 3], owner[surface.mate[h] / 3]);
      }
    }
  }
}

}  // namespace
}  // namespace kiln
