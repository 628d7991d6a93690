// unwrap() by charts: what its header promises, on shapes that are known to be hard.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "kiln/unwrap.h"
#include "support/environment.h"
#include "support/shapes.h"
#include "unwrap/charts_check.h"
#include "unwrap/unwrap_charts.h"

namespace kiln {
namespace {

using test::check_charts;
using test::LayoutFacts;

Mesh of(std::vector<Vec3> positions, std::vector<Triangle> triangles) {
  Mesh mesh;
  mesh.name = "test";
  mesh.positions = std::move(positions);
  mesh.triangles = std::move(triangles);
  return mesh;
}

LayoutFacts charted(const Mesh& mesh, const UnwrapOptions& options = {}, Mesh* result = nullptr) {
  UnwrapReport report;
  const LayoutFacts facts = check_charts(mesh, options, report, result);
  EXPECT_EQ(report.border_texels, options.border_texels);
  return facts;
}

/// Vertices that a renderer has after splitting, over the positions in use.
double vertices_a_position(const Mesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> vertices;
  std::set<std::uint32_t> positions;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      vertices.insert({mesh.triangles[t][k], mesh.uv_triangles[t][k]});
      positions.insert(mesh.triangles[t][k]);
    }
  }
  return static_cast<double>(vertices.size()) / static_cast<double>(positions.size());
}

TEST(Charts, OneTriangle) {
  EXPECT_EQ(charted(of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}})).charts, 1u);
}

TEST(Charts, FlatAreaIsOneChartWithoutDistortion) {
  const LayoutFacts facts = charted(test::plane(24, 20, 3, 2), {.size = 512});
  EXPECT_EQ(facts.charts, 1u);
  EXPECT_LT(facts.density_spread, 1e-3);
}

/// Formulas leave such triangles at the pole of a sphere, where sin(pi) is 1e-16.
TEST(Charts, TrianglesThatRoundToAPointHaveNoTexels) {
  constexpr float kTiny = 1e-17F;
  const Mesh mesh =
      of({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {0, 0, 0}, {kTiny, 0, 0}, {0, kTiny, 0}},
         {{3, 4, 5}, {0, 1, 2}});
  const Mesh laid_out = unwrap(mesh, {.size = 128});
  EXPECT_EQ(laid_out.triangles, mesh.triangles);
  EXPECT_EQ(laid_out.uv_triangles[0], (Triangle{0, 0, 0}));
  EXPECT_EQ(laid_out.uvs[0], (Vec2{0, 0}));
  EXPECT_EQ(laid_out.uvs.size(), 4U);
  for (const Vec2& uv : laid_out.uvs) EXPECT_TRUE(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1);
  // Alone, they are large.
  EXPECT_EQ(charted(of({{0, 0, 0}, {kTiny, 0, 0}, {0, kTiny, 0}}, {{0, 1, 2}})).charts, 1U);
}

/// A square bar along x or y, of so many pieces along it.
void add_bar(Mesh& mesh, const Vec3& from, bool along_x, float length, std::uint32_t pieces) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const float wide = 0.01F;
  for (std::uint32_t i = 0; i <= pieces; ++i) {
    const float at = length * static_cast<float>(i) / static_cast<float>(pieces);
    for (const auto& [a, b] : {std::pair{0.0F, 0.0F}, {wide, 0.0F}, {wide, wide}, {0.0F, wide}}) {
      mesh.positions.push_back(along_x ? Vec3{from.x + at, from.y + a, from.z + b}
                                       : Vec3{from.x + b, from.y + at, from.z + a});
    }
  }
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.triangles.push_back({first + a, first + c, first + d});
  };
  for (std::uint32_t i = 0; i < pieces; ++i) {
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t next = (k + 1) % 4;
      quad(4 * i + k, 4 * (i + 1) + k, 4 * (i + 1) + next, 4 * i + next);
    }
  }
  quad(0, 1, 2, 3);
  quad(4 * pieces + 3, 4 * pieces + 2, 4 * pieces + 1, 4 * pieces);
}

/// A fence: bars and two rails. A strip that is longer than the surface is wide says how small all else is.
TEST(Charts, LongBarsDoNotLeaveTheMapEmpty) {
  Mesh fence = of({}, {});
  for (int i = 0; i < 20; ++i) add_bar(fence, {0.1F * static_cast<float>(i), 0, 0}, false, 1, 8);
  for (const float y : {0.25F, 0.75F}) add_bar(fence, {-0.05F, y, 0.1F}, true, 2, 16);
  UnwrapReport report;
  check_charts(fence, {.size = 2048}, report, nullptr);
  EXPECT_GT(report.coverage, 0.6);  // Measured: 0.71; 0.43 with strips of any length.
  EXPECT_LT(report.charts, 22U * 6);
}

TEST(Charts, CubeIsFewChartsOfEvenDensity) {
  const LayoutFacts facts = charted(test::cube(), {.size = 512});
  EXPECT_LE(facts.charts, 6u);
  EXPECT_LT(facts.density_spread, 0.05);
}

TEST(Charts, ClosedSurfacesOfEveryGenusAreCutOpen) {
  for (const Mesh& mesh : {test::tetrahedron(), test::icosphere(2), test::uv_sphere(20, 12),
                           test::torus(24, 12), test::torus(40, 8, 1)}) {
    Mesh out;
    const LayoutFacts facts = charted(mesh, {.size = 512}, &out);
    EXPECT_EQ(facts.collapsed, 0u);
    EXPECT_LT(facts.charts, std::max<std::size_t>(4, mesh.triangles.size() / 10)) << mesh.name;
    EXPECT_LT(facts.density_spread, 0.5);
  }
}

TEST(Charts, PartsStayApart) {
  Mesh mesh = of({}, {});
  for (std::uint32_t part = 0; part < 12; ++part) {
    const Mesh one = test::tetrahedron();
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (Vec3 p : one.positions) {
      p.x += 5 * static_cast<float>(part);
      mesh.positions.push_back(p);
    }
    for (const Triangle& t : one.triangles) {
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  EXPECT_GE(charted(mesh).charts, 12u);
}

TEST(Charts, SoupsHaveAChartATriangle) {
  EXPECT_EQ(charted(test::random_soup(150, 3), {.size = 1024}).charts, 150u);
}

TEST(Charts, ManyTrianglesAtOneEdge) {
  Mesh mesh = of({{0, 0, 0}, {0, 0, 1}}, {});
  for (std::uint32_t i = 0; i < 30; ++i) {
    const double angle = 0.2 * i;
    mesh.positions.push_back(
        {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0.5F});
    mesh.triangles.push_back({0, 1, i + 2});
  }
  EXPECT_EQ(charted(mesh).charts, 30u);
}

TEST(Charts, TrianglesThatDisagreeInOrientationAreNotJoined) {
  const Mesh mesh = of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 3, 2}});
  EXPECT_EQ(charted(mesh).charts, 2u);
}

TEST(Charts, BothSidesOfOneSheet) {
  const Mesh mesh = of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}});
  EXPECT_EQ(charted(mesh).charts, 2u);
}

TEST(Charts, NeedlesKeepAnArea) {
  Mesh mesh = of({{0, 0, 0}, {1, 0, 0}}, {});
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto x = static_cast<float>(i) / 40;
    mesh.positions.push_back({x, 1e-6F * static_cast<float>(i % 7 + 1), 1});
    if (i > 0) mesh.triangles.push_back({0, i + 2, i + 1});
  }
  mesh.positions.push_back({0.5F, 1e-7F, 0});
  mesh.triangles.push_back({0, 1, static_cast<std::uint32_t>(mesh.positions.size() - 1)});
  EXPECT_EQ(charted(mesh).collapsed, 0u);
}

TEST(Charts, TrianglesTooSmallForTheGridStandAlone) {
  Mesh mesh = test::plane(6, 6);
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const Vec3 p = mesh.positions[mesh.triangles[0][0]];
  mesh.positions.push_back({p.x, p.y, 1e-9F});
  mesh.positions.push_back({p.x, p.y, 2e-9F});
  mesh.positions.push_back({p.x, p.y + 0x1p-22F, 1e-9F});
  mesh.triangles.push_back({first, first + 1, first + 2});
  const LayoutFacts facts = charted(mesh, {.size = 256});
  EXPECT_EQ(facts.collapsed, 0u);
  EXPECT_EQ(facts.charts, 2u);
}

TEST(Charts, TrianglesWithoutAreaCoverNothingAndAreCounted) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  UnwrapReport report;
  const LayoutFacts facts =
      check_charts(of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {nan, 0, 0}},
                      {{0, 1, 2}, {0, 1, 3}, {0, 1, 1}, {0, 1, 4}}),
                   {}, report);
  EXPECT_EQ(facts.charts, 1u);
  EXPECT_EQ(facts.collapsed, 3u);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_EQ(report.warnings[0].code, "degenerate-triangles");
  EXPECT_EQ(report.warnings[0].count, 3u);
}

TEST(Charts, BordersAsAskedOrShrunkWithAWarning) {
  const Mesh mesh = test::icosphere(2);
  for (const std::uint32_t border : {1U, 2U, 5U, 16U}) {
    charted(mesh, {.size = 500, .border_texels = border});
  }
  UnwrapReport report;
  check_charts(test::random_soup(80, 5), {.size = 128, .border_texels = 16}, report);
  EXPECT_LT(report.border_texels, 16);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_EQ(report.warnings[0].code, "border-shrunk");
}

/// Strips of 250 times their width, as hair leaves: a map cannot hold what each shows, and says so.
TEST(Charts, NarrowerThanATexelAreTold) {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto height = static_cast<float>(i);
    for (const float x : {0.0F, 1.0F}) {
      for (const float y : {0.0F, 0.004F}) points.push_back({x, y, height});
    }
    triangles.push_back({4 * i, 4 * i + 2, 4 * i + 3});
    triangles.push_back({4 * i, 4 * i + 3, 4 * i + 1});
  }
  const auto narrow = [&](std::uint32_t size) {
    UnwrapReport report;
    unwrap(of(points, triangles), {.method = UnwrapMethod::charts, .size = size}, &report);
    std::uint64_t count = 0;
    for (const Warning& warning : report.warnings) {
      if (warning.code == "narrow-charts") count += warning.count;
    }
    return count;
  };
  EXPECT_EQ(narrow(128), 40U);
  EXPECT_EQ(narrow(4096), 0U);
}

TEST(Charts, AnyScaleGivesTheSameLayout) {
  Mesh mesh = test::torus(16, 8);
  const UnwrapOptions options{.method = UnwrapMethod::charts, .size = 256};
  const Mesh expected = unwrap(mesh, options);
  for (const float scale : {0x1p-60F, 0x1p40F}) {
    Mesh scaled = mesh;
    for (Vec3& p : scaled.positions) p = {p.x * scale, p.y * scale, p.z * scale};
    EXPECT_EQ(unwrap(scaled, options).uvs, expected.uvs);
  }
}

TEST(Charts, ThreadsChangeNothing) {
  const UnwrapOptions options{.method = UnwrapMethod::charts, .size = 256};
  const Mesh mesh = test::BumpySphere::dense(1200);
  const Mesh one = unwrap_charts(mesh, options, nullptr, 1);
  for (const int threads : {2, 5}) {
    const Mesh more = unwrap_charts(mesh, options, nullptr, threads);
    EXPECT_EQ(more.uvs, one.uvs);
    EXPECT_EQ(more.uv_triangles, one.uv_triangles);
  }
}

TEST(Charts, RoughRocksHaveFewCharts) {
  // Noise of a few edges' width: no patch of it is nearly flat.
  Mesh rock = test::BumpySphere::dense(6000), out;
  for (Vec3& p : rock.positions) {
    const double x = p.x, y = p.y, z = p.z;
    const double bumps = std::sin(11 * x + 3 * y) * std::sin(12 * y - 4 * z) +
                         std::sin(13 * z + 5 * x) * std::sin(17 * x + 16 * y - 9 * z);
    const auto r = static_cast<float>(1 + 0.12 * bumps);
    p = {r * p.x, r * p.y, r * p.z};
  }
  const LayoutFacts facts = charted(rock, {.size = 2048, .border_texels = 8}, &out);
  EXPECT_LT(facts.charts, 40u);
  EXPECT_LT(vertices_a_position(out), 1.2);
  EXPECT_GT(facts.coverage, 0.7);
}

TEST(Charts, BunnyHasFewSeams) {
  KILN_REQUIRE_DATA("bunny_low.obj");
  Mesh low = load_mesh(*test::shared_data("bunny_low.obj")), out;
  const LayoutFacts facts = charted(low, {.size = 1024, .border_texels = 8}, &out);
  EXPECT_EQ(facts.collapsed, 0u);
  EXPECT_LT(vertices_a_position(out), 1.32);
  EXPECT_GT(facts.coverage, 0.7);
  EXPECT_LT(facts.density_spread, 0.4);
}

/// Two corners that round to one point leave a triangle without a shape: its neighbours' charts are as without it.
TEST(Charts, TrianglesThatRoundToALineHaveAPlace) {
  constexpr float kTiny = 1e-17F;
  for (const std::array<std::uint32_t, 3>& order :
       {std::array{3U, 4U, 5U}, {4U, 5U, 3U}, {5U, 3U, 4U}}) {
    const Mesh mesh =
        of({{-2, -1, 0}, {1, -1, 0.5F}, {1, 3, 0}, {0, 0, 0}, {kTiny, 0, 0}, {0, 1, 0}},
           {{order[0], order[1], order[2]}, {0, 1, 2}});
    UnwrapReport report;
    const Mesh laid_out = unwrap(mesh, {.size = 128}, &report);
    EXPECT_EQ(laid_out.triangles, mesh.triangles);
    for (const Vec2& uv : laid_out.uvs) {
      EXPECT_TRUE(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1) << uv.x << " " << uv.y;
    }
    EXPECT_TRUE(std::isfinite(report.coverage) && report.coverage > 0.1) << report.coverage;
    EXPECT_TRUE(std::isfinite(report.density_spread)) << report.density_spread;
  }
}

TEST(Charts, SayWhichMeshHasNoArea) {
  for (const UnwrapMethod method : {UnwrapMethod::charts, UnwrapMethod::pairs}) {
    Mesh mesh = of({{0, 0, 0}, {1, 2, 3}, {2, 4, 6}}, {{0, 1, 2}, {0, 2, 1}});
    mesh.name = "line.obj";
    try {
      (void)unwrap(mesh, {.method = method});
      ADD_FAILURE() << "no area, no layout";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input);
      EXPECT_STREQ(
          error.what(),
          "unwrap: mesh 'line.obj' has no triangle of positive area; check the file it was "
          "read from");
    }
  }
}

}  // namespace
}  // namespace kiln
