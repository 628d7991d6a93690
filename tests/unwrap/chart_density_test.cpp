// Texels by detail: scales of charts, where they are cut, and layouts that follow a high poly.
#include "unwrap/chart_density.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "kiln/limits.h"
#include "kiln/unwrap.h"
#include "support/shapes.h"
#include "unwrap/charts_check.h"
#include "unwrap/pairing.h"
#include "unwrap/unwrap_charts.h"

namespace kiln {
namespace {

/// A piece whose error falls like this power of the side, from this one at the side 1.
TexelNeed need(double area, double error, double power) {
  TexelNeed piece{area, {}};
  for (std::size_t k = 0; k < kTexelSides.size(); ++k) {
    piece.errors[k] = area * error * std::pow(kTexelSides[k], power);
  }
  return piece;
}

double area_taken(const std::vector<TexelNeed>& needs, const std::vector<double>& scales) {
  double sum = 0;
  for (std::size_t i = 0; i < needs.size(); ++i) sum += needs[i].area * scales[i] * scales[i];
  return sum;
}

TEST(TexelScales, FollowTheErrorInClosedForm) {
  // With one power p for all, s goes with e^(1 / (2 + p)). Errors are far above what is added to them.
  const std::vector<TexelNeed> needs = {need(1, 100, 1), need(2, 200, 1), need(0.5, 800, 1)};
  const std::vector<double> scales = texel_scales(needs);
  EXPECT_NEAR(scales[1] / scales[0], std::cbrt(2.0), 0.01);
  EXPECT_NEAR(scales[2] / scales[0], 2, 0.02);
  EXPECT_NEAR(area_taken(needs, scales), 3.5, 1e-9);
  EXPECT_LT(expected_error(needs, scales), expected_error(needs, std::vector<double>(3, 1)));
}

/// Errors are those of the mesh's triangles, by area; triangles without area have no part in them.
TEST(TexelScales, NeedsFollowTheTrianglesOfTheMesh) {
  Mesh mesh = test::plane(3, 2);
  mesh.triangles.insert(mesh.triangles.begin() + 4, Triangle{0, 0, 1});
  mesh.triangles.insert(mesh.triangles.begin(), Triangle{2, 2, 2});
  std::vector<TexelErrors> errors(mesh.triangles.size());
  for (std::size_t t = 0; t < errors.size(); ++t) {
    for (std::size_t k = 0; k < errors[t].size(); ++k)
      errors[t][k] = static_cast<double>(10 * t + k);
  }
  const ChartSurface surface = chart_surface(mesh);
  ASSERT_EQ(surface.triangles.size() + 2, mesh.triangles.size());
  const std::vector<TexelNeed> needs = texel_needs(surface, errors);
  ASSERT_EQ(needs.size(), surface.triangles.size());
  for (std::size_t t = 0; t < needs.size(); ++t) {
    EXPECT_EQ(needs[t].area, surface.area[t]);
    for (std::size_t k = 0; k < kTexelSides.size(); ++k) {
      const std::size_t triangle = t < 4 ? t + 1 : t + 2;
      EXPECT_DOUBLE_EQ(needs[t].errors[k],
                       surface.area[t] * static_cast<double>(10 * triangle + k));
    }
  }
}

TEST(TexelScales, NoOthersOfTheSameAreaAreBetter) {
  std::mt19937 dice(7);
  const auto unit = [&] { return static_cast<double>(dice() % 65536) / 65536; };
  for (int round = 0; round < 50; ++round) {
    std::vector<TexelNeed> needs;
    needs.reserve(8);
    for (int i = 0; i < 8; ++i) {
      needs.push_back(need(0.1 + unit(), 0.1 * std::exp2(unit()), 0.5 + unit()));
    }
    const std::vector<double> best = texel_scales(needs);
    double area = 0;
    for (const TexelNeed& piece : needs) area += piece.area;
    EXPECT_NEAR(area_taken(needs, best), area, 1e-9 * area);
    const auto [least, most] = std::minmax_element(best.begin(), best.end());
    EXPECT_LE(*most, kMaxDensityRatio * *least * (1 + 1e-9));
    for (int other = 0; other < 20; ++other) {
      std::vector<double> scales = best;
      for (double& s : scales) s *= 1 + 0.2 * (unit() - 0.5);
      const double all = std::sqrt(area / area_taken(needs, scales));
      for (double& s : scales) s *= all;
      EXPECT_GE(expected_error(needs, scales), expected_error(needs, best) * (1 - 1e-9));
    }
  }
}

TEST(TexelScales, AreEvenWhereNothingDiffersOrNothingIsToBeSeen) {
  for (const double error : {0.0, 0.3}) {
    for (const double s : texel_scales(std::vector<TexelNeed>(4, need(0.7, error, 1)))) {
      EXPECT_NEAR(s, 1, 1e-9);
    }
  }
}

TEST(TexelScales, KeepToTheirRange) {
  const std::vector<double> scales = texel_scales(std::vector{need(1, 1e-6, 1), need(0.25, 50, 1)});
  EXPECT_NEAR(scales[1] / scales[0], kMaxDensityRatio, 1e-3);
}

/// A flat sheet of side 4, with waves over the corner of side 1. Its low poly is flat.
Mesh sheet(std::uint32_t cells, bool waves) {
  Mesh mesh = test::plane(cells, cells, 4, 4);
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (Vec3& p : mesh.positions) {
    const double x = double{p.x} + 2, y = double{p.y} + 2;
    if (waves && x < 1 && y < 1) {
      p.z += static_cast<float>(0.01 * std::sin(31.4159 * x) * std::sin(31.4159 * y));
    }
  }
  return mesh;
}

/// Texels that triangles in the corner cover, over what others do for as much surface.
double corner_over_rest(const Mesh& mesh) {
  double inside = 0, outside = 0, surface_inside = 0, surface = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 &a = mesh.positions[mesh.triangles[t][0]], &b = mesh.positions[mesh.triangles[t][1]],
               &c = mesh.positions[mesh.triangles[t][2]];
    const Vec2 &p = mesh.uvs[mesh.uv_triangles[t][0]], &q = mesh.uvs[mesh.uv_triangles[t][1]],
               &r = mesh.uvs[mesh.uv_triangles[t][2]];
    const double own = std::abs((double{b.x} - a.x) * (double{c.y} - a.y) -
                                (double{c.x} - a.x) * (double{b.y} - a.y));
    const double map = std::abs((double{q.x} - p.x) * (double{r.y} - p.y) -
                                (double{r.x} - p.x) * (double{q.y} - p.y));
    const bool in = a.x + b.x + c.x < -3 && a.y + b.y + c.y < -3;
    (in ? inside : outside) += map;
    (in ? surface_inside : surface) += own;
  }
  return inside / surface_inside / (outside / surface);
}

TEST(UnwrapByDetail, ACornerWithWavesGetsMoreTexels) {
  const Mesh high = sheet(320, true), low = sheet(16, false);
  UnwrapOptions options{.size = 128, .border_texels = 2};
  UnwrapReport even, uneven;
  Mesh by_area, by_detail;
  test::check_charts(low, options, even, &by_area);
  options.detail_of = &high;
  test::check_charts(low, options, uneven, &by_detail);
  EXPECT_NEAR(corner_over_rest(by_area), 1, 0.01);
  EXPECT_EQ(even.charts, 1U);
  // Nothing but the corner needs texels, so it has as many more as it may: in area at most the square.
  EXPECT_GT(uneven.charts, 1U);
  EXPECT_GT(corner_over_rest(by_detail), 4);
  EXPECT_LT(corner_over_rest(by_detail), 1.01 * kMaxDensityRatio * kMaxDensityRatio);
}

TEST(UnwrapByDetail, IsTheSameAsByAreaWhereDetailIsEven) {
  const Mesh low = sheet(16, false), high = sheet(64, false);
  const UnwrapOptions options{.size = 128, .border_texels = 2};
  UnwrapOptions detailed = options;
  detailed.detail_of = &high;
  EXPECT_EQ(unwrap(low, detailed).uvs, unwrap(low, options).uvs);
}

/// A flat sheet with waves over one corner.
struct WavySheet {
  double width = 0, height = 0, waves_width = 0, waves_height = 0, amplitude = 0;
};

/// Sheets above each other.
Mesh stacked(const std::vector<WavySheet>& sheets, std::uint32_t cells, bool waves) {
  Mesh mesh;
  float level = 0;
  for (const WavySheet& sheet : sheets) {
    const Mesh flat = test::plane(cells, cells, sheet.width, sheet.height);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (Vec3 p : flat.positions) {
      const double x = p.x + sheet.width / 2, y = p.y + sheet.height / 2;
      p.z = level;
      if (waves && x < sheet.waves_width && y < sheet.waves_height)
        p.z += static_cast<float>(sheet.amplitude * std::sin(12.5 * x) * std::sin(12.5 * y));
      mesh.positions.push_back(p);
    }
    for (const Triangle& t : flat.triangles)
      mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    level += 3;
  }
  return mesh;
}

/// Sheets of their own density are better than sheets of one, and better than with a cut more: in a map this small,
/// its padding takes more texels than the cut saves.
TEST(UnwrapByDetail, LeavesOutCutsThatCostMoreThanTheySave) {
  const std::vector<WavySheet> sheets = {
      {0.7, 3.7, 0.3, 2.8, 0.013}, {0.7, 3.3, 0.2, 0.2, 0.009}, {2.5, 3.9, 2.2, 3.8, 0.001}};
  const Mesh low = stacked(sheets, 6, false), high = stacked(sheets, 40, true);
  UnwrapOptions options{.size = 16, .border_texels = 3};
  const Mesh by_area = unwrap(low, options);
  options.detail_of = &high;
  UnwrapReport report;
  const Mesh by_detail = unwrap(low, options, &report);
  EXPECT_EQ(report.charts, 3U);
  EXPECT_NE(by_detail.uvs, by_area.uvs);
}

TEST(UnwrapByDetail, KeepsPaddingAndIsTheSameOnAllThreads) {
  for (std::uint32_t seed = 0; seed < 4 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 dice(seed);
    const auto below = [&](std::uint32_t count) {
      return static_cast<std::uint32_t>(dice() % count);
    };
    const auto unit = [&] { return static_cast<float>(dice() % 65536) / 65536; };
    const bool ball = seed % 2 == 0;
    Mesh low = ball ? test::uv_sphere(6 + below(6), 4 + below(4)) : test::torus(7 + below(6), 5);
    Mesh high = ball ? test::uv_sphere(80, 50) : test::torus(90, 40);
    low.uvs.clear();
    low.uv_triangles.clear();
    // Rough on one side.
    for (Vec3& p : high.positions) {
      if (p.x > 0) p.z += 0.03F * unit();
    }
    for (Mesh* mesh : {&low, &high}) {
      mesh->normals.clear();
      mesh->normal_triangles.clear();
    }
    UnwrapOptions options{.size = 48 + below(100)};
    options.border_texels = 1 + below(3);
    options.detail_of = &high;
    UnwrapReport report;
    Mesh once;
    set_thread_limit(2);
    test::check_charts(low, options, report, &once);
    set_thread_limit(0);
    const TexelDetail detail(high);
    EXPECT_EQ(unwrap_charts(low, options, nullptr, 1, &detail).uvs, once.uvs);
  }
}

/// A strip of quads along x, laid flat as it is.
FlatTriangles laid(const Mesh& mesh) {
  FlatTriangles flat;
  for (const Triangle& t : mesh.triangles) {
    std::array<Vec2d, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = mesh.positions[t[k]];
      corners[k] = {p.x, p.y};
    }
    flat.corners.push_back(corners);
    std::array<std::uint32_t, 3> beside{kNoIndex, kNoIndex, kNoIndex};
    for (std::uint32_t other = 0; other < mesh.triangles.size(); ++other) {
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t l = 0; l < 3; ++l) {
          const Triangle& o = mesh.triangles[other];
          if (o[l] == t[(k + 1) % 3] && o[(l + 1) % 3] == t[k]) beside[k] = other;
        }
      }
    }
    flat.neighbours.push_back(beside);
  }
  return flat;
}

TEST(TexelDetail, SeesWhereTheLowPolysNormalsTurn) {
  // A flat high poly over a flat low poly whose own normals lean: a map in tangent space must turn back, and a
  // texel over the ridge cannot.
  const Mesh high = sheet(8, false);
  Mesh low = sheet(2, false);
  const FlatTriangles flat = laid(low);
  const TexelDetail detail(high);
  const auto sum = [&](std::size_t side) {
    double total = 0;
    for (const TexelErrors& e : detail.errors(low, flat, 16, 1)) total += e[side];
    return total;
  };
  low.normals = {{0, 0, 1}};
  low.normal_triangles.assign(low.triangles.size(), {0, 0, 0});
  EXPECT_LT(sum(0), 1e-6);
  low.normals.clear();
  for (const Vec3& p : low.positions) {
    const float lean = p.x == low.positions[0].x ? 0.6F : 0.0F;
    low.normals.push_back({lean, 0, std::sqrt(1 - lean * lean)});
  }
  low.normal_triangles = low.triangles;
  EXPECT_GT(sum(0), 0.05);
  EXPECT_GT(sum(0), 2 * sum(2));
}

TEST(UnwrapByDetail, RefusesPairsAndBadHighPolys) {
  const Mesh low = sheet(4, false);
  Mesh high = sheet(8, true);
  UnwrapOptions options{.method = UnwrapMethod::pairs, .size = 64};
  options.detail_of = &high;
  EXPECT_THROW(unwrap(low, options), Error);
  options.method = UnwrapMethod::charts;
  EXPECT_NO_THROW(unwrap(low, options));
  high.triangles[0][1] = 100000;
  EXPECT_THROW(unwrap(low, options), Error);
}

}  // namespace
}  // namespace kiln
