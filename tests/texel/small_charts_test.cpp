// Charts between the centres of samples: which texels they get, and which of their points.
#include "texel/small_charts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bake/report.h"
#include "image/gutter.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "texel/texel_samples.h"

namespace kiln {
namespace {

using test::kNothing;
using test::Map;
using test::ReferenceTriangle;
using test::sample_all;
using test::surface_of;
using Point = std::array<double, 2>;

/// Two triangles over a rectangle, in texels from the map's upper left corner.
std::vector<ReferenceTriangle> quad(double left, double top, double right, double bottom,
                                    double width, double height) {
  const auto at = [&](double x, double y) {
    return test::ReferenceUv{static_cast<float>(x / width), static_cast<float>(1 - y / height)};
  };
  return {{{at(left, bottom), at(right, bottom), at(right, top)}},
          {{at(left, bottom), at(right, top), at(left, top)}}};
}

/// The same with positions by UVs, so that triangles share their vertices.
LowSurface flat_surface(const std::vector<ReferenceTriangle>& triangles) {
  LowSurface surface = surface_of(triangles);
  for (auto& corners : surface.triangles) {
    for (LowSurface::Corner& corner : corners) corner.position = {corner.uv.x, corner.uv.y, 0};
  }
  return surface;
}

Point nearest_point(const std::array<Point, 3>& corners, const Point& to) {
  const auto cross = [](const Point& a, const Point& b, const Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  };
  bool left = true, right = true;
  Point best{};
  double least = 1e300;
  for (std::size_t k = 0; k < 3; ++k) {
    const Point &a = corners[k], &b = corners[(k + 1) % 3];
    left = left && cross(a, b, to) >= 0;
    right = right && cross(a, b, to) <= 0;
    const double x = b[0] - a[0], y = b[1] - a[1];
    const double share =
        std::clamp(((to[0] - a[0]) * x + (to[1] - a[1]) * y) / (x * x + y * y), 0.0, 1.0);
    const Point at{a[0] + share * x, a[1] + share * y};
    const double away = std::hypot(at[0] - to[0], at[1] - to[1]);
    if (away < least) {
      least = away;
      best = at;
    }
  }
  return left || right ? to : best;
}

double distance(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

std::array<Point, 3> outline(const ReferenceTriangle& triangle, double width, double height) {
  std::array<Point, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    corners[k] = {triangle[k].u * width, (1 - double{triangle[k].v}) * height};
  }
  return corners;
}

double area_of(const std::array<Point, 3>& c) {
  return std::abs((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) -
                  (c[1][1] - c[0][1]) * (c[2][0] - c[0][0])) /
         2;
}

/// The area of a triangle within a texel.
double area_within(const std::array<Point, 3>& corners, double column, double row) {
  std::vector<Point> polygon(corners.begin(), corners.end());
  for (int side = 0; side < 4; ++side) {
    const std::size_t axis = side / 2;
    const double sign = side % 2 == 0 ? 1 : -1;
    const double bound = (axis == 0 ? column : row) + (side % 2 == 0 ? 0 : 1);
    std::vector<Point> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double at_a = sign * (a[axis] - bound), at_b = sign * (b[axis] - bound);
      if (at_a >= 0) kept.push_back(a);
      if ((at_a > 0 && at_b < 0) || (at_a < 0 && at_b > 0)) {
        const double share = at_a / (at_a - at_b);
        kept.push_back({a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])});
      }
    }
    polygon = kept;
  }
  double area = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    area += (a[0] * b[1] - b[0] * a[1]) / 2;
  }
  return std::abs(area);
}

std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> owners(const SmallCharts& small) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> result;
  for (const AssignedTexel& texel : small.texels)
    result[{texel.row, texel.column}] = texel.triangle;
  EXPECT_EQ(result.size(), small.texels.size()) << "a texel twice";
  return result;
}

/// By brute force: every triangle is a chart of its own.
TEST(SmallCharts, GetTheTexelsThatBruteForceGives) {
  std::mt19937 random(5);
  constexpr std::uint32_t kWidth = 24, kHeight = 17;
  std::uniform_real_distribution<float> unit(0, 1), large(-0.2F, 0.2F), tiny(-0.03F, 0.03F);
  for (int round = 0; round < 30; ++round) {
    const std::uint32_t samples = 1 + static_cast<std::uint32_t>(round) % 3;
    std::vector<ReferenceTriangle> triangles;
    for (int i = 0; i < 25; ++i) {
      const float u = unit(random), v = unit(random);
      auto& spread = i % 5 == 0 ? large : tiny;
      const auto corner = [&] {
        return test::ReferenceUv{std::clamp(u + spread(random), 0.0F, 1.0F),
                                 std::clamp(v + spread(random), 0.0F, 1.0F)};
      };
      triangles.push_back({corner(), corner(), corner()});
    }
    const LowSurface surface = surface_of(triangles);
    const TexelPieces pieces = TexelPieces::of(surface, kWidth * samples, kHeight * samples);
    const SmallCharts small = SmallCharts::of(surface, pieces, kWidth, kHeight, samples);

    const std::vector<test::ReferenceSample> reference =
        test::reference_samples(triangles, kWidth, kHeight, static_cast<int>(samples));
    std::set<std::pair<std::uint32_t, std::uint32_t>> taken;
    std::set<std::uint32_t> covers;
    for (std::size_t i = 0; i < reference.size(); ++i) {
      if (reference[i].covering == 0) continue;
      const auto row = static_cast<std::uint32_t>(i / (kWidth * samples) / samples);
      const auto column = static_cast<std::uint32_t>(i % (kWidth * samples) / samples);
      taken.insert({row, column});
    }
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      // Also where another one wins.
      const auto alone =
          test::reference_samples({triangles[t]}, kWidth, kHeight, static_cast<int>(samples));
      if (std::any_of(alone.begin(), alone.end(), [](const auto& s) { return s.covering > 0; })) {
        covers.insert(t);
      }
    }
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> wanted;
    std::set<std::uint32_t> has, charts;
    const auto away = [&](std::uint32_t t, std::uint32_t row, std::uint32_t column) {
      const Point centre{column + 0.5, row + 0.5};
      return distance(nearest_point(outline(triangles[t], kWidth, kHeight), centre), centre);
    };
    const auto give = [&](std::uint32_t t, std::pair<std::uint32_t, std::uint32_t> texel) {
      wanted[texel] = t;
      taken.insert(texel);
      has.insert(t);
    };
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      if (covers.contains(t) || area_of(outline(triangles[t], kWidth, kHeight)) == 0) continue;
      charts.insert(t);
      std::tuple<double, std::uint32_t, std::uint32_t> best{8.0 + 1e-12, 0, 0};
      bool found = false;
      for (std::uint32_t row = 0; row < kHeight; ++row) {
        for (std::uint32_t column = 0; column < kWidth; ++column) {
          const std::tuple candidate{away(t, row, column), row, column};
          if (taken.contains({row, column}) || !(candidate < best)) continue;
          best = candidate;
          found = true;
        }
      }
      if (found) give(t, {std::get<1>(best), std::get<2>(best)});
    }
    for (std::uint32_t row = 0; row < kHeight; ++row) {
      for (std::uint32_t column = 0; column < kWidth; ++column) {
        if (taken.contains({row, column})) continue;
        std::pair<double, std::uint32_t> best{1e300, 0};
        for (const std::uint32_t t : charts) {
          if (!(area_within(outline(triangles[t], kWidth, kHeight), column, row) > 1e-9)) continue;
          best = std::min(best, std::pair{away(t, row, column), t});
        }
        if (best.first < 1e300) give(best.second, {row, column});
      }
    }
    EXPECT_EQ(owners(small), wanted) << round;
    EXPECT_EQ(small.triangles, std::vector<std::uint32_t>(charts.begin(), charts.end()));
    std::vector<std::uint32_t> without;
    std::set_difference(charts.begin(), charts.end(), has.begin(), has.end(),
                        std::back_inserter(without));
    EXPECT_EQ(small.triangles_without_texel, without);
  }
}

/// Squares of a tenth of a texel: their own texel, and the sample is their point nearest to its centre.
TEST(SmallCharts, OfRivetsAreSampledAtTheNearestPoint) {
  KILN_REQUIRE_DEVICE();
  constexpr std::uint32_t kSide = 32;
  std::vector<ReferenceTriangle> triangles;
  for (std::uint32_t row = 1; row < kSide; row += 4) {
    for (std::uint32_t column = 1; column < kSide; column += 4) {
      const auto both = quad(column + 0.1, row + 0.7, column + 0.2, row + 0.8, kSide, kSide);
      triangles.insert(triangles.end(), both.begin(), both.end());
    }
  }
  for (const std::uint32_t samples : {1U, 2U, 3U}) {
    const Map map = sample_all(flat_surface(triangles), {kSide, kSide, samples, 1U << 22});
    EXPECT_EQ(map.report.overlapping_samples, 0U);
    EXPECT_EQ(map.report.samples, map.report.texels * samples * samples);
    std::set<std::uint32_t> seen;
    for (std::size_t i = 0; i < map.triangle.size(); ++i) {
      if (map.triangle[i] == kNothing) continue;
      seen.insert(map.triangle[i]);
      const auto corners = outline(triangles[map.triangle[i]], kSide, kSide);
      const Point at{map.point[i][0] * double{kSide}, (1 - double{map.point[i][1]}) * kSide};
      // Positions are floats of the map's unit: 2^-24 of 32 texels, a few times.
      EXPECT_LT(distance(nearest_point(corners, at), at), 1e-4) << "beside its triangle";
      const Point centre{std::floor(static_cast<double>(i % map.columns) / samples) + 0.5,
                         std::floor(static_cast<double>(i / map.columns) / samples) + 0.5};
      if (samples == 1) {
        const Point wanted = nearest_point(corners, centre);
        // A 256th of the way to the middle, which is 0.1 texels long at most.
        EXPECT_NEAR(at[0], wanted[0], 5e-4);
        EXPECT_NEAR(at[1], wanted[1], 5e-4);
      }
      EXPECT_LT(distance(nearest_point(corners, centre), centre), 1.2);
    }
    EXPECT_EQ(seen.size(), triangles.size());
  }
}

/// A slat of 0.8 texels by 40 between two columns of centres: the column that it lies in, all along.
TEST(SmallCharts, OfSlatsAreCoveredAlongTheirLength) {
  KILN_REQUIRE_DEVICE();
  const auto triangles = quad(10.55, 4.25, 11.35, 44.25, 64, 64);
  const Map map = sample_all(flat_surface(triangles), {64, 64, 1, 1U << 22});
  for (std::uint32_t row = 0; row < 64; ++row) {
    for (std::uint32_t column = 0; column < 64; ++column) {
      const std::size_t i = std::size_t{row} * 64 + column;
      const bool reached = (column == 10 || column == 11) && row >= 4 && row <= 44;
      ASSERT_EQ(map.triangle[i] != kNothing, reached) << column << " " << row;
      if (!reached) continue;
      EXPECT_NEAR(map.point[i][0] * 64, column == 10 ? 10.55 : 11.35, 0.8 / 256);
      // Beside the diagonal the other triangle may be nearer by less than the slat is wide.
      const double y = std::clamp(row + 0.5, 4.25, 44.25);
      EXPECT_NEAR((1 - map.point[i][1]) * 64, y, 40.0 / 256 + 0.05);
    }
  }
}

/// Texels of ordinary charts stay as they are, whatever lies among them.
TEST(SmallCharts, LeaveOtherSamplesAsTheyAre) {
  KILN_REQUIRE_DEVICE();
  std::mt19937 random(8);
  std::vector<ReferenceTriangle> triangles;
  for (int i = 0; i < 40; ++i) triangles.push_back(test::random_triangle(random, 0.01F));
  for (int i = 0; i < 10; ++i) triangles.push_back(test::random_triangle(random, 0.2F));
  const LowSurface surface = surface_of(triangles);
  for (const std::uint32_t samples : {1U, 2U, 5U}) {
    for (const std::uint32_t band : {1U << 22, 1U << 9}) {
      const Map plain = sample_all(surface, {37, 29, samples, band, false});
      const Map all = sample_all(surface, {37, 29, samples, band});
      std::size_t more = 0;
      for (std::size_t i = 0; i < plain.triangle.size(); ++i) {
        if (plain.triangle[i] == kNothing) {
          more += all.triangle[i] != kNothing ? 1 : 0;
          continue;
        }
        ASSERT_EQ(all.triangle[i], plain.triangle[i]);
        ASSERT_EQ(all.point[i], plain.point[i]);
      }
      EXPECT_GT(more, 0U);
      EXPECT_EQ(all.report.overlapping_samples, plain.report.overlapping_samples);
    }
  }
}

TEST(SmallCharts, AreCountedWhereNoTexelIsFree) {
  std::vector<ReferenceTriangle> triangles = quad(0, 0, 32, 32, 32, 32);
  const auto inner = quad(15.1, 15.1, 15.2, 15.2, 32, 32);
  triangles.insert(triangles.end(), inner.begin(), inner.end());
  const LowSurface surface = flat_surface(triangles);
  const SmallCharts small = SmallCharts::of(surface, TexelPieces::of(surface, 32, 32), 32, 32, 1);
  EXPECT_TRUE(small.texels.empty());
  EXPECT_EQ(small.triangles, (std::vector<std::uint32_t>{2, 3}));
  EXPECT_EQ(small.triangles_without_texel, small.triangles);
  // On a map of one texel the first chart has it.
  const LowSurface two = flat_surface(quad(0.1, 0.1, 0.2, 0.2, 1, 1));
  const SmallCharts one = SmallCharts::of(two, TexelPieces::of(two, 1, 1), 1, 1, 1);
  ASSERT_EQ(one.texels.size(), 1U);
  EXPECT_EQ(one.triangles_without_texel.size(), 1U);
}

/// Edges through samples' centres belong to the chart whose left or upper edge they are: the other one has no sample.
TEST(SmallCharts, AreThoseThatEndAtCentresOnTheRightOrBelow) {
  const auto is_small = [](double left, double top, double right, double bottom) {
    const LowSurface surface = flat_surface(quad(left, top, right, bottom, 32, 32));
    return !SmallCharts::of(surface, TexelPieces::of(surface, 32, 32), 32, 32, 1).triangles.empty();
  };
  EXPECT_FALSE(is_small(10.5, 10.5, 10.75, 10.75));
  EXPECT_TRUE(is_small(10.25, 10.5, 10.5, 10.75));
  EXPECT_TRUE(is_small(10.5, 10.25, 10.75, 10.5));
  EXPECT_TRUE(is_small(10.25, 10.25, 10.5, 10.5));
}

/// The texel nearest to a chart is that of its nearest triangle, whichever comes first.
TEST(SmallCharts, GiveTheFirstTexelToTheNearestTriangle) {
  const auto owner = [](double left, double top) {
    const LowSurface surface = flat_surface(quad(left, top, left + 0.1, top + 0.1, 32, 32));
    return owners(SmallCharts::of(surface, TexelPieces::of(surface, 32, 32), 32, 32, 1))
        .at({10, 10});
  };
  EXPECT_EQ(owner(10.2, 10.2), 0U) << "its lower right corner";
  EXPECT_EQ(owner(10.8, 10.8), 1U) << "its upper left corner";
}

/// Within a large chart that ends in column 11, the nearest free centre is at 12.5: up to 8 texels away.
TEST(SmallCharts, TakeTexelsUpToEightAway) {
  for (const double away : {7.9, 8.1}) {
    auto triangles = quad(0, 0, 12, 64, 64, 64);
    const auto inner = quad(12.45 - away, 31.45, 12.5 - away, 31.55, 64, 64);
    triangles.insert(triangles.end(), inner.begin(), inner.end());
    const LowSurface surface = flat_surface(triangles);
    const SmallCharts small = SmallCharts::of(surface, TexelPieces::of(surface, 64, 64), 64, 64, 1);
    ASSERT_EQ(small.triangles.size(), 2U);
    EXPECT_EQ(small.texels.empty(), away > 8) << away;
    EXPECT_EQ(small.triangles_without_texel.size(), away > 8 ? 2U : 0U);
  }
}

/// On maps of several tiles of 64 texels, of which only some have small charts: a texel of a large chart is given to none,
/// in whichever row of its tile it lies.
TEST(SmallCharts, TakeNoTexelsOfChartsThatCrossTiles) {
  constexpr std::uint32_t kWidth = 96, kHeight = 256;
  for (const std::uint32_t samples : {1U, 3U}) {
    for (const double row : {63.0, 64.0, 65.0, 128.0, 191.0, 192.0}) {
      auto triangles = quad(60, 3, 70, 250, kWidth, kHeight);
      const auto inner = quad(69.05, row + 0.05, 69.1, row + 0.1, kWidth, kHeight);
      triangles.insert(triangles.end(), inner.begin(), inner.end());
      const LowSurface surface = flat_surface(triangles);
      const SmallCharts small =
          SmallCharts::of(surface, TexelPieces::of(surface, kWidth * samples, kHeight * samples),
                          kWidth, kHeight, samples);
      ASSERT_EQ(small.triangles.size(), 2U);
      ASSERT_EQ(small.texels.size(), 2U);
      for (const AssignedTexel& texel : small.texels)
        EXPECT_EQ(texel.column, 70U) << row << " " << texel.row;
    }
    // Only the first row of a tile is within reach of these; the tiles above it are of no small chart.
    for (const double row : {72.2, 136.2, 200.2}) {
      auto triangles = quad(30, 3, 90, 250, kWidth, kHeight);
      const auto inner = quad(60.1, row, 60.2, row + 0.1, kWidth, kHeight);
      triangles.insert(triangles.end(), inner.begin(), inner.end());
      const LowSurface surface = flat_surface(triangles);
      const SmallCharts small =
          SmallCharts::of(surface, TexelPieces::of(surface, kWidth * samples, kHeight * samples),
                          kWidth, kHeight, samples);
      EXPECT_TRUE(small.texels.empty()) << row;
      EXPECT_EQ(small.triangles_without_texel.size(), 2U);
    }
  }
}

/// Triangles that touch a chart with samples are part of it: padding serves them.
TEST(SmallCharts, AreNotSliversOfOtherCharts) {
  std::vector<ReferenceTriangle> triangles = quad(4, 4, 20, 20, 64, 64);
  const auto sliver = quad(20, 4, 20.3, 20, 64, 64);
  triangles.insert(triangles.end(), sliver.begin(), sliver.end());
  const LowSurface surface = flat_surface(triangles);
  EXPECT_TRUE(
      SmallCharts::of(surface, TexelPieces::of(surface, 64, 64), 64, 64, 1).triangles.empty());
}

/// Parts of a file: each owns a texel near its chart, by mask and coverage alike, and the report counts them.
TEST(SmallCharts, OfRivetsAndSlatsAreBaked) {
  KILN_REQUIRE_DEVICE();
  for (const std::string name : {"rivets", "slats"}) {
    KILN_REQUIRE_DATA("cases/rivets/" + name + ".obj");
    const Mesh low = load_mesh(test::shared_data("cases/rivets/" + name + ".obj")->string());
    const Mesh high = load_mesh(test::shared_data("cases/rivets/hi_" + name + ".obj")->string());
    const std::vector<std::uint32_t> chart = [&] {
      std::vector<std::uint32_t> of(low.triangles.size());
      for (std::size_t t = 0; t < of.size(); ++t) {
        of[t] = low.polygons.empty() ? static_cast<std::uint32_t>(t / 2) : low.polygons[t];
      }
      return of;
    }();
    BakeOptions options;
    options.width = options.height = 64;
    options.maps = {MapKind::normal, MapKind::mask, MapKind{"height"}};
    options.report.recall = 0;
    for (const std::uint32_t samples : {1U, 3U}) {
      options.samples = samples;
      const BakeResult baked = bake(Source(*test::device(), high), low, options);
      EXPECT_EQ(baked.report.missed, 0U) << name;
      // With 3 x 3 samples a slat of 0.8 texels covers some.
      EXPECT_EQ(baked.report.small_triangles > 0, samples == 1 || name == "rivets") << name;
      EXPECT_EQ(baked.report.small_triangles_without_texel, 0U) << name;
      const Image& mask = baked.map(MapKind::mask).image;
      std::set<std::uint32_t> near;
      for (std::uint32_t y = 0; y < 64; ++y) {
        for (std::uint32_t x = 0; x < 64; ++x) {
          const bool covered = baked.coverage[std::size_t{y} * 64 + x] == kCoverageBaked;
          EXPECT_EQ(*mask.at(x, y) > 0, covered);
          if (!covered) continue;
          for (std::size_t t = 0; t < low.triangles.size(); ++t) {
            std::array<Point, 3> corners;
            for (std::size_t k = 0; k < 3; ++k) {
              const Vec2& uv = low.uvs[low.uv_triangles[t][k]];
              corners[k] = {uv.x * 64.0, (1 - double{uv.y}) * 64};
            }
            const Point centre{x + 0.5, y + 0.5};
            if (distance(nearest_point(corners, centre), centre) < 1) near.insert(chart[t]);
          }
        }
      }
      EXPECT_EQ(near.size(), std::size_t{chart.back()} + 1) << name;
      const auto warned =
          std::count_if(baked.report.warnings.begin(), baked.report.warnings.end(),
                        [](const Warning& warning) { return warning.code == "uv-small"; });
      EXPECT_EQ(warned, baked.report.small_triangles > 0 ? 1 : 0) << name;
    }
  }
}

/// Five triangles without a texel are named; of more, the number of other names is given.
TEST(SmallCharts, WarningsNameFiveTriangles) {
  for (const std::size_t count : {1U, 5U, 6U, 8U}) {
    Mesh low;
    SmallCharts small;
    for (std::uint32_t t = 0; t < count; ++t) {
      low.triangles.push_back({0, 1, 2});
      low.objects.push_back(t);
      low.object_names.push_back("part" + std::to_string(t));
      small.triangles.push_back(t);
      small.triangles_without_texel.push_back(t);
    }
    std::vector<Warning> warnings;
    warn_about_small_charts(small, low, warnings);
    ASSERT_EQ(warnings.size(), 1U);
    const std::string text = warnings[0].message.text();
    for (std::size_t t = 0; t < count; ++t) {
      EXPECT_EQ(text.find("'part" + std::to_string(t) + "'") != std::string::npos, t < 5) << text;
    }
    const std::string others = "and triangles of " +
                               std::to_string(count - std::min<std::size_t>(count, 5)) +
                               " other names";
    EXPECT_EQ(text.find(others) != std::string::npos, count > 5) << text;
  }
}

/// Corners of equal UVs that lie apart along any one axis are of two charts: the small one is not of the large one.
TEST(SmallCharts, AreApartWhereCornersDifferAlongOneAxis) {
  const auto chart_at = [](const Vec3& away) {
    // The large chart's lower right corner, (20, 20), is the upper left one of the small chart.
    std::vector<ReferenceTriangle> triangles = quad(4, 4, 20, 20, 64, 64);
    const auto inner = quad(20, 20, 20.25, 20.125, 64, 64);
    triangles.insert(triangles.end(), inner.begin(), inner.end());
    LowSurface surface = flat_surface(triangles);
    for (std::size_t t = 2; t < 4; ++t) {
      for (LowSurface::Corner& corner : surface.triangles[t]) {
        corner.position.x += away.x;
        corner.position.y += away.y;
        corner.position.z += away.z;
      }
    }
    return SmallCharts::of(surface, TexelPieces::of(surface, 64, 64), 64, 64, 1);
  };
  EXPECT_TRUE(chart_at({0, 0, 0}).triangles.empty()) << "one chart";
  for (const Vec3& away : {Vec3{0.5F, 0, 0}, Vec3{0, 0.25F, 0}, Vec3{0, 0, 0.125F}}) {
    const SmallCharts small = chart_at(away);
    EXPECT_EQ(small.triangles, (std::vector<std::uint32_t>{2, 3})) << away.x << away.y << away.z;
    EXPECT_TRUE(owners(small).contains({20, 20}));
  }
}

}  // namespace
}  // namespace kiln
