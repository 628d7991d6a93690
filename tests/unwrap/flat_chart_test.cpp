// Flat charts by closed forms: what can be unrolled is unrolled, and what overlaps is seen.
#include "unwrap/flat_chart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "support/shapes.h"
#include "unwrap/chart_choice.h"
#include "unwrap/chart_growth.h"
#include "unwrap/flat_predicates.h"
#include "unwrap/flat_system.h"
#include "unwrap/pairing.h"

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

/// Fills a system with random blocks whose diagonal outweighs the rest, solves it, and multiplies back.
template <std::size_t N>
void expect_solved(std::uint32_t nx, std::uint32_t ny) {
  const ChartSurface surface = bent(nx, ny, nx, ny, [](double x, double y) {
    return Vec3d{x, y, 0};
  });
  FlatChart chart = sheet(surface);
  project_to_mean_plane(chart, surface);
  FlatSystem<N> system(chart);
  std::mt19937 random(nx);
  const auto number = [&] { return static_cast<double>(random() % 1000) / 1000; };
  struct Entry {
    std::uint32_t a = 0, b = 0;
    double xx = 0, xy = 0, yy = 0;
  };
  for (int again = 0; again < 2; ++again) {  // The pattern is used more than once.
    std::vector<Entry> entries;
    system.clear();
    const auto add = [&](typename FlatSystem<N>::Block& block, const Entry& entry) {
      entries.push_back(entry);
      if (entry.a != entry.b) entries.push_back({entry.b, entry.a, entry.xx, entry.xy, entry.yy});
      block[0] += entry.xx;
      if constexpr (N == 2) {
        block[1] += entry.xy;
        block[2] += entry.xy;
        block[3] += entry.yy;
      }
    };
    const auto part = [&](std::uint32_t a, std::uint32_t b, double weight) {
      const double xx = weight * (1 + number());
      if (N == 1) return Entry{a, b, xx, 0, xx};
      return Entry{a, b, xx, 0.2 * weight * number(), weight * (1 + number())};
    };
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const Triangle& t = chart.triangles[i];
      for (std::size_t k = 0; k < 3; ++k) {
        add(system.corner_block(i, k), part(t[k], t[k], 6));
        add(system.edge_block(i, k), part(t[k], t[(k + 1) % 3], -0.5));
      }
    }
    std::vector<Vec2d> right(chart.points.size());
    for (Vec2d& p : right) p = {number(), number()};
    std::vector<Vec2d> points = right;
    ASSERT_TRUE(system.factorize());
    ASSERT_TRUE(system.solve(points));
    for (const Entry& e : entries) {
      const Vec2d& p = points[e.b];
      right[e.a] = right[e.a] - Vec2d{e.xx * p.x + e.xy * p.y, e.xy * p.x + e.yy * p.y};
    }
    for (const Vec2d& rest : right) {
      EXPECT_NEAR(rest.x, 0, 1e-12);
      EXPECT_NEAR(rest.y, 0, 1e-12);
    }
  }
  system.vertex_block(0)[0] = -1;
  EXPECT_FALSE(system.factorize());
}

TEST(FlatSystem, SolutionsMultiplyBack) {
  expect_solved<1>(1, 1);
  expect_solved<1>(9, 7);
  expect_solved<2>(1, 1);
  expect_solved<2>(9, 7);
  expect_solved<2>(40, 2);
}

/// Tutte's map: the border on a circle of the chart's area, all else at the mean of its neighbours.
void lay_on_circle(FlatChart& chart) {
  std::vector<std::vector<std::uint32_t>> beside(chart.points.size());
  double area = 0;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    area += chart.rest[i].area;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = chart.triangles[i][k], b = chart.triangles[i][(k + 1) % 3];
      beside[a].push_back(b), beside[b].push_back(a);
    }
  }
  const double radius = std::sqrt(area / std::numbers::pi);
  for (std::size_t i = 0; i < chart.boundary.size(); ++i) {
    const double angle =
        2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(chart.boundary.size());
    chart.points[chart.boundary[i]] = {radius * std::cos(angle), radius * std::sin(angle)};
    beside[chart.boundary[i]].clear();
  }
  for (int round = 0; round < 3000; ++round) {
    for (std::size_t v = 0; v < beside.size(); ++v) {
      if (beside[v].empty()) continue;
      Vec2d sum{};
      for (const std::uint32_t other : beside[v]) sum = sum + chart.points[other];
      chart.points[v] = sum * (1 / static_cast<double>(beside[v].size()));
    }
  }
}

TEST(FlatChart, LessThanHalfACylinderUnrolls) {
  const ChartSurface surface = bent(24, 6, 2.6, 1, [](double x, double y) {
    return Vec3d{std::cos(x), std::sin(x), y};
  });
  FlatChart chart = sheet(surface);
  ASSERT_TRUE(flatten_chart(chart, surface));
  injective_rounds(chart, 10);
  EXPECT_TRUE(is_injective(chart));
  EXPECT_LT(distortion(chart).energy, 1e-6);
  EXPECT_LT(distortion(chart).max_stretch, 1.01);
}

TEST(FlatChart, RoundsFlattenACapOfASphere) {
  const ChartSurface surface = bent(16, 16, 1.6, 1.6, [](double x, double y) {
    const double u = x - 0.8, v = y - 0.8, r = std::hypot(u, v);
    const double s = r > 0 ? std::sin(r) / r : 1;
    return Vec3d{u * s, v * s, std::cos(r)};
  });
  FlatChart chart = sheet(surface);
  project_to_mean_plane(chart, surface);
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
    return Vec2d{radius * std::cos(angle * at.x), radius * std::sin(angle * at.x)};
  };
  const ChartSurface surface = bent(60, 3, 1, 1, [&](double x, double y) {
    const Vec2d p = ring({x, y, 0}, 370 * degree);
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

/// A ring whose rest shape turns by more than a full turn, laid out as that, so that its ends overlap.
FlatChart overlapping_ring(double degrees, const ChartSurface& surface) {
  FlatChart chart = sheet(surface);
  for (std::size_t v = 0; v < chart.points.size(); ++v) {
    const Vec3d& p = surface.positions[chart.vertex[v]];
    chart.points[v] = {p.x, p.y};
  }
  EXPECT_FALSE(is_injective(chart)) << degrees;
  EXPECT_LT(rigid_energy(chart), 0.01);
  return chart;
}

ChartSurface ring_surface(double degrees) {
  return bent(90, 3, 1, 1, [degrees](double x, double y) {
    const double radius = 3 - y, angle = x * degrees * std::numbers::pi / 180;
    return Vec3d{radius * std::cos(angle), radius * std::sin(angle), 1e-3 * x};
  });
}

TEST(FlatChart, EndsThatOverlapALittleArePulledApart) {
  const ChartSurface surface = ring_surface(366);
  FlatChart chart = overlapping_ring(366, surface);
  ASSERT_TRUE(untangle(chart, {20}, *rigid_system(chart)));
  EXPECT_TRUE(is_injective(chart, chart.min_border_distance));
  const ChartLimits limits;
  EXPECT_LT(distortion(chart).energy, limits.energy);
  EXPECT_LT(distortion(chart).max_stretch, limits.max_stretch);
}

TEST(FlatChart, EndsThatOverlapMuchAreLeft) {
  const ChartSurface surface = ring_surface(500);
  FlatChart chart = overlapping_ring(500, surface);
  EXPECT_FALSE(untangle(chart, {10}, *rigid_system(chart)));
}

TEST(FlatChart, AFlippedTriangleIsTurned) {
  const ChartSurface surface = bent(6, 6, 1, 1, [](double x, double y) { return Vec3d{x, y, 0}; });
  FlatChart chart = sheet(surface);
  project_to_mean_plane(chart, surface);
  ASSERT_TRUE(is_injective(chart));
  std::uint32_t inner = 0;
  while (std::find(chart.boundary.begin(), chart.boundary.end(), inner) != chart.boundary.end()) {
    ++inner;
  }
  chart.points[inner] = chart.points[inner] + Vec2d{0.2, 0.25};
  ASSERT_FALSE(is_injective(chart));
  ASSERT_TRUE(untangle(chart, {10}, *rigid_system(chart)));
  injective_rounds(chart, 8);
  EXPECT_LT(distortion(chart).energy, 1e-3);
}

TEST(FlatChart, CrumpledSheetsLieOnACircleOneToOne) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const ChartSurface surface = bent(12, 10, 1, 1, [&](double x, double y) {
      return Vec3d{x, y, 0.3 * static_cast<double>(random() % 1000) / 1000};
    });
    FlatChart chart = sheet(surface);
    lay_on_circle(chart);
    EXPECT_TRUE(is_injective(chart));
    const double start = distortion(chart).energy;
    injective_rounds(chart, 10);
    EXPECT_TRUE(is_injective(chart));
    EXPECT_LT(distortion(chart).energy, 0.5 * start);
    // Solvers that may end before do, and within the bound.
    lay_on_circle(chart);
    const ChartLimits limits{.energy = 0.4 * start};
    ASSERT_FALSE(is_within_limits(chart, limits));
    injective_rounds(chart, 10, &limits);
    EXPECT_TRUE(is_within_limits(chart, limits));
  }
}

TEST(FlatChart, RoundsKeepTheBorderApart) {
  const ChartSurface surface = bent(40, 2, 6.1, 0.5, [](double x, double y) {
    // A ring that nearly closes, in its plane: relaxed it stays so.
    return Vec3d{(1 + y) * std::sin(x), (1 + y) * std::cos(x), 0.2 * std::sin(9 * x)};
  });
  FlatChart chart = sheet(surface);
  chart.min_border_distance = 0.05;
  lay_on_circle(chart);
  injective_rounds(chart, 30);
  EXPECT_TRUE(is_injective(chart, chart.min_border_distance));
}

TEST(FlatChart, BendsAreTheAngleThatIsMissing) {
  const double pi = std::numbers::pi;
  const ChartSurface rolled = bent(20, 6, 3, 1, [](double x, double y) {
    return Vec3d{std::cos(x), std::sin(x), y};
  });
  for (const double bend : rolled.bend) EXPECT_NEAR(bend, 0, 1e-12);
  EXPECT_NEAR(sheet(rolled).roughness_energy, 0, 1e-12);
  // A pyramid's tip: four times 60 degrees.
  Mesh tip;
  tip.positions = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
  tip.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  const double missing = std::log(4 * (pi / 3) / (2 * pi));
  const ChartSurface pyramid = chart_surface(tip);
  for (std::size_t t = 0; t < 4; ++t) {
    EXPECT_NEAR(pyramid.bend[t], missing / 3, 1e-6);
    EXPECT_NEAR(pyramid.bend_squared[t], missing * missing / 3, 1e-6);
  }
}

TEST(FlatChart, RoughnessIsAllowedForButNotShape) {
  // All of a cube's bends are the same.
  Mesh box = test::cube();
  const ChartSurface cube = chart_surface(box);
  std::vector<std::uint8_t> glued(cube.mate.size(), 0);
  std::vector<std::uint32_t> local(cube.triangles.size());
  EXPECT_NEAR(cut_open(cube, std::array<std::uint32_t, 1>{0}, glued, local).roughness_energy, 0,
              1e-9);
  std::mt19937 random(3);
  const ChartSurface rough = bent(30, 30, 1, 1, [&](double x, double y) {
    return Vec3d{x, y, 0.06 * static_cast<double>(random() % 1000) / 1000};
  });
  FlatChart chart = sheet(rough);
  EXPECT_GT(chart.roughness_energy, 0.02);
  // No map of it has much less.
  lay_on_circle(chart);
  injective_rounds(chart, 60);
  EXPECT_GT(distortion(chart).energy, 0.4 * chart.roughness_energy);
  EXPECT_LT(distortion(chart).energy, 1.5 * chart.roughness_energy);
}

TEST(FlatChart, SimplePolygons) {
  const std::vector<Vec2d> square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_TRUE(is_simple(square));
  EXPECT_FALSE(is_simple(std::vector<Vec2d>{{0, 0}, {1, 1}, {1, 0}, {0, 1}}));
  EXPECT_FALSE(is_simple(std::vector<Vec2d>{{0, 0}, {2, 0}, {1, 0}, {0, 1}})) << "folds back";
  EXPECT_FALSE(is_simple(std::vector<Vec2d>{{0, 0}, {4, 0}, {4, 2}, {2, 0}, {0, 2}})) << "touches";
  EXPECT_TRUE(is_simple(std::vector<Vec2d>{{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}})) << "straight";
  const std::vector<Vec2d> hook{{0, 0},   {3, 0},     {3, 1},     {0, 1},
                                {0, 0.9}, {2.9, 0.9}, {2.9, 0.1}, {0, 0.1}};
  EXPECT_TRUE(is_simple(hook, 0.09));
  EXPECT_FALSE(is_simple(hook, 0.11));
  EXPECT_FALSE(first_touching_sides(hook, 0.09).has_value());
}

/// Each pair of sides, looked at alone: what touches is found, and no other pair.
TEST(FlatChart, TouchingSidesAreThoseOfAllPairs) {
  std::mt19937 random(31);
  const auto unit = [&] { return static_cast<double>(random() % 1024) / 1024; };
  std::size_t touching = 0, apart = 0;
  for (int round = 0; round < 300; ++round) {
    const std::size_t count = 3 + random() % 10;
    std::vector<Vec2d> polygon;
    for (std::size_t i = 0; i < count; ++i) {
      const double angle =
          2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
      const double radius = 0.05 + unit();
      // Stars, some of them rough, and polygons that cross themselves.
      polygon.push_back(round % 3 == 0 ? Vec2d{unit(), unit()}
                                       : Vec2d{radius * std::cos(angle), radius * std::sin(angle)} +
                                             Vec2d{unit(), unit()} * (round % 3 * 0.2));
    }
    const double distance = round % 2 * 0.3 * unit();
    std::vector<std::pair<std::size_t, std::size_t>> expected;
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        const std::size_t between = std::min(b - a, count - (b - a)) - 1;
        if (between == 0) continue;
        const std::array<Vec2d, 4> p{polygon[a], polygon[(a + 1) % count], polygon[b],
                                     polygon[(b + 1) % count]};
        bool boxes_meet = true;
        for (const auto& axis : {&Vec2d::x, &Vec2d::y}) {
          boxes_meet =
              boxes_meet &&
              std::max(p[0].*axis, p[1].*axis) + distance >= std::min(p[2].*axis, p[3].*axis) &&
              std::max(p[2].*axis, p[3].*axis) + distance >= std::min(p[0].*axis, p[1].*axis);
        }
        if (boxes_meet &&
            !segments_apart_certain(p[0], p[1], p[2], p[3], between == 1 ? 0 : distance)) {
          expected.emplace_back(a, b);
        } else {
          ++apart;
        }
      }
    }
    touching += expected.size();
    std::vector<std::pair<std::size_t, std::size_t>> found = touching_sides(polygon, distance, 999);
    for (auto& [a, b] : found) {
      if (a > b) std::swap(a, b);
    }
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected) << round;
    EXPECT_EQ(is_simple(polygon, distance), expected.empty());
    EXPECT_EQ(touching_sides(polygon, distance, 1).size(),
              std::min<std::size_t>(expected.size(), 1));
  }
  EXPECT_GT(touching, 100U);
  EXPECT_GT(apart, 1000U);
}

/// Of three sheets at one edge the two that run on most smoothly are one surface, in whatever order they stand; sheets
/// that face opposite ways are not.
TEST(ChartSurface, SheetsGoOnWhereTheyBendLeast) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {-1, 0, 0.2F}, {0, 0, -1}, {-1, 0, -0.1F}};
  // The first three run on to each other over the edge 0 1; the last is turned over.
  const std::vector<Triangle> sheets{{1, 0, 2}, {0, 1, 3}, {0, 1, 4}, {1, 0, 5}};
  std::vector<std::size_t> order{0, 1, 2, 3};
  do {
    mesh.triangles.clear();
    for (const std::size_t i : order) mesh.triangles.push_back(sheets[i]);
    const ChartSurface surface = chart_surface(mesh);
    ASSERT_EQ(surface.triangles.size(), 4U);
    const auto place = [&](std::size_t sheet) {
      return static_cast<std::uint32_t>(std::find(order.begin(), order.end(), sheet) -
                                        order.begin());
    };
    // The half-edge from corner 0 of each is the shared one.
    const auto mate = [&](std::size_t sheet) { return surface.mate[3 * place(sheet)]; };
    EXPECT_EQ(mate(0), 3 * place(1));
    EXPECT_EQ(mate(1), 3 * place(0));
    EXPECT_EQ(mate(2), 3 * place(3));
    EXPECT_EQ(mate(3), 3 * place(2));
    for (std::uint32_t h = 0; h < 12; ++h) {
      if (h % 3 != 0) EXPECT_EQ(surface.mate[h], kNoIndex);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  // A fifth sheet bends less than the second, but runs along the edge as the first does: it would face the other way.
  mesh.positions.push_back({1, 0, 0.1F});
  mesh.triangles = {{1, 0, 6}, sheets[0], sheets[1]};
  const ChartSurface surface = chart_surface(mesh);
  EXPECT_EQ(surface.mate[0], kNoIndex);
  EXPECT_EQ(surface.mate[3], 6U);
  EXPECT_EQ(surface.mate[6], 3U);
}

/// Relaxed charts have the area of their surface each, and outlines are their borders.
TEST(FlatChart, RelaxedChartsHaveTheirSurfacesArea) {
  const ChartSurface surface = chart_surface(test::BumpySphere::dense(1200));
  ChartBorders borders(surface);
  std::vector<FlatChart> charts = grow_charts(surface, borders, {});
  ASSERT_GT(charts.size(), 1U);
  for (FlatChart& chart : charts) {
    for (Vec2d& p : chart.points) p = p * 1.3;
  }
  relax_charts(charts, 2);
  const std::vector<Outline> outlines = outlines_of(charts);
  ASSERT_EQ(outlines.size(), charts.size());
  for (std::size_t i = 0; i < charts.size(); ++i) {
    double area = 0, enclosed = 0;
    for (const std::uint32_t t : charts[i].source) area += surface.area[t];
    EXPECT_NEAR(flat_area(charts[i]), area, 1e-9 * area);
    EXPECT_NEAR(outlines[i].area, area, 1e-9 * area);
    ASSERT_EQ(outlines[i].rings.size(), 1U);
    const std::vector<Vec2d>& ring = outlines[i].rings[0];
    ASSERT_EQ(ring.size(), charts[i].boundary.size());
    for (std::size_t k = 0; k < ring.size(); ++k)
      enclosed += cross(ring[k], ring[(k + 1) % ring.size()]) / 2;
    EXPECT_NEAR(enclosed, area, 1e-9 * area);
  }
}

TEST(FlatChart, GrownChartsOfASphereAreDiscsThatCoverIt) {
  const ChartSurface surface = chart_surface(test::icosphere(2));
  ChartBorders borders(surface);
  const std::vector<FlatChart> charts = grow_charts(surface, borders, {});
  std::vector<int> seen(surface.triangles.size(), 0);
  for (const FlatChart& chart : charts) {
    EXPECT_TRUE(is_injective(chart));
    EXPECT_TRUE(is_within_limits(chart, {}));
    for (const std::uint32_t t : chart.source) ++seen[t];
    // Euler: a disc has V - E + F = 1, and E = (3 F + border) / 2.
    EXPECT_EQ(2 * chart.points.size() - chart.triangles.size() - chart.boundary.size(), 2u);
  }
  for (const int count : seen) EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace kiln
