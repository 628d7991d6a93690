// Cuts of flat charts: limbs come off, what is compact stays whole, and every part is a disc.
#include "unwrap/chart_cuts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "support/shapes.h"
#include "unwrap/chart_cut_search.h"
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

/// Extents of some triangles of a chart along 16 directions, and the area of the smallest of the 8 boxes.
double box_of(const FlatChart& chart, const std::vector<std::uint8_t>& apart, std::uint8_t side) {
  constexpr std::size_t kCount = CutShape::kDirections;
  std::vector<double> low(kCount, HUGE_VAL), high(kCount, -HUGE_VAL);
  for (std::size_t t = 0; t < chart.triangles.size(); ++t) {
    if (apart[t] != side) continue;
    for (const std::uint32_t v : chart.triangles[t]) {
      for (std::size_t d = 0; d < kCount; ++d) {
        const double angle = std::numbers::pi * static_cast<double>(d) / kCount;
        const double at = dot(chart.points[v], Vec2d{std::cos(angle), std::sin(angle)});
        low[d] = std::min(low[d], at), high[d] = std::max(high[d], at);
      }
    }
  }
  double least = HUGE_VAL;
  for (std::size_t d = 0; d < kCount / 2; ++d) {
    least = std::min(least, (high[d] - low[d]) * (high[d + kCount / 2] - low[d + kCount / 2]));
  }
  return least;
}

bool is_connected(const ChartNeighbours& neighbours, const std::vector<std::uint8_t>& apart,
                  std::uint8_t side) {
  std::vector<std::uint8_t> seen(apart.size(), 0);
  const auto first = std::find(apart.begin(), apart.end(), side);
  if (first == apart.end()) return false;
  std::vector<std::uint32_t> open{static_cast<std::uint32_t>(first - apart.begin())};
  seen[open[0]] = 1;
  std::size_t count = 0;
  while (!open.empty()) {
    const std::uint32_t t = open.back();
    open.pop_back();
    ++count;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t n = neighbours[3 * t + k];
      if (n == kNoIndex || seen[n] != 0 || apart[n] != side) continue;
      seen[n] = 1;
      open.push_back(n);
    }
  }
  return count == static_cast<std::size_t>(std::count(apart.begin(), apart.end(), side));
}

/// A cut gains what the boxes shrink by, less its price; none of the 13 lines that parts the chart in two gains more
/// for its length.
TEST(ChartCuts, GainsAreTheAreasOfBoxesLessThePrice) {
  const std::vector<std::function<bool(double, double)>> shapes{
      cross_shape, [](double x, double y) { return x < 0.2 || y < 0.3; },
      [](double x, double y) { return y < 0.15 || (x > 0.7 && x < 0.85) || x < 0.2 + 0.3 * y; },
      [](double x, double y) { return std::abs(y - 0.5 - 0.3 * std::sin(9 * x)) < 0.1; }};
  int found = 0;
  for (const auto& inside : shapes) {
    const AtlasBitmap sheet(inside);
    ASSERT_EQ(sheet.charts.size(), 1U);
    const FlatChart& chart = sheet.charts[0];
    std::vector<std::uint32_t> local(sheet.surface.triangles.size());
    for (std::uint32_t t = 0; t < chart.source.size(); ++t) local[chart.source[t]] = t;
    ChartNeighbours neighbours;
    for (const std::uint32_t t : chart.source) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t h = 3 * t + k;
        neighbours.push_back(sheet.borders.is_glued(h) ? local[sheet.surface.mate[h] / 3]
                                                       : kNoIndex);
      }
    }
    const CutShape shape(sheet.surface, chart, neighbours);
    const double area = sheet.surface.total_area, extent = std::sqrt(area);
    const double whole = box_of(chart, std::vector<std::uint8_t>(chart.source.size(), 0), 0);
    EXPECT_NEAR(shape.box_area, whole, 1e-5 * whole);
    EXPECT_NEAR(smallest_box(chart), whole, 1e-5 * whole);
    EXPECT_NEAR(shape.area, area, 1e-9);
    const std::vector<CutPrice> prices{{0, 0, 0, 0},
                                       {0.02 * extent, 0, 0, 0},
                                       {0, 0.05 * extent, 0, 0},
                                       {0.01 * extent, 0.01 * extent, 0.3 / area, 0},
                                       {0, 0, 0, 0.2 * area}};
    struct Measures {
      double boxes = 0, length = 0, part = 0;
      bool is_connected = false;
    };
    const auto measure = [&](const std::vector<std::uint8_t>& apart) {
      Measures result{box_of(chart, apart, 0) + box_of(chart, apart, 1), 0, 0,
                      is_connected(neighbours, apart, 0) && is_connected(neighbours, apart, 1)};
      for (std::uint32_t t = 0; t < apart.size(); ++t) {
        if (apart[t] == 0) continue;
        result.part += chart.rest[t].area;
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::uint32_t n = neighbours[3 * t + k];
          if (n != kNoIndex && apart[n] == 0)
            result.length += sheet.surface.length[3 * chart.source[t] + k];
        }
      }
      return result;
    };
    const auto gain_of = [&](const Measures& cut, const CutPrice& price) {
      return whole - cut.boxes - cut.length * (2 * price.margin + price.seam) +
             2 * price.size * cut.part * (area - cut.part);
    };
    for (const std::size_t d : {0U, 3U, 8U, 13U}) {
      const double angle = std::numbers::pi * static_cast<double>(d) / CutShape::kDirections;
      std::vector<double> centres;
      double low = HUGE_VAL, high = -HUGE_VAL;
      for (const Triangle& t : chart.triangles) {
        double sum = 0;
        for (const std::uint32_t v : t) {
          const double along = dot(chart.points[v], Vec2d{std::cos(angle), std::sin(angle)});
          low = std::min(low, along), high = std::max(high, along), sum += along / 3;
        }
        centres.push_back(sum);
      }
      std::vector<Measures> lines;
      for (int line = 1; line <= 13; ++line) {
        std::vector<std::uint8_t> apart;
        for (const double at : centres) apart.push_back(at < low + (high - low) * line / 14.0);
        lines.push_back(measure(apart));
      }
      const std::vector<ChartCut> cuts = shape.best_cuts(d, prices);
      ASSERT_EQ(cuts.size(), prices.size());
      for (std::size_t p = 0; p < prices.size(); ++p) {
        SCOPED_TRACE(std::to_string(d) + " at price " + std::to_string(p));
        const ChartCut& cut = cuts[p];
        const double least_part = std::max(0.01 * area, prices[p].min_part_area);
        if (cut.gain > 0) {
          ++found;
          const Measures own = measure(cut.apart);
          EXPECT_NEAR(cut.gain, gain_of(own, prices[p]), 1e-4 * area);
          EXPECT_NEAR(cut.length, own.length, 1e-9);
          EXPECT_GE(std::min(own.part, area - own.part), least_part * (1 - 1e-9));
          EXPECT_TRUE(own.is_connected);
        }
        const double best = cut.gain > 0 ? cut.gain / cut.length : 0;
        for (const Measures& line : lines) {
          if (std::min(line.part, area - line.part) < 1.001 * least_part || !line.is_connected)
            continue;
          // A cut is skipped if boxes of 1.1 times the area would not be worth it, and single triangles on a line may
          // lie on either side.
          EXPECT_GE(best * line.length,
                    0.95 * (gain_of(line, prices[p]) - 0.1 * area) - 0.01 * area);
        }
      }
    }
  }
  EXPECT_GT(found, 20);
}

}  // namespace
}  // namespace kiln
