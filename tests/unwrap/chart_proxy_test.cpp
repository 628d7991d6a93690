// Proxies are what the surface is, with fewer triangles; charts chosen on them hold on the surface.
#include "unwrap/chart_proxy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kiln/limits.h"
#include "kiln/unwrap.h"
#include "support/shapes.h"
#include "unwrap/charts_check.h"
#include "unwrap/pairing.h"
#include "unwrap/unwrap_charts.h"

namespace kiln {
namespace {

/// Vertices less edges plus triangles; a vertex for each fan.
std::int64_t euler_number(const ChartSurface& surface) {
  std::int64_t edges = 0;
  for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
    if (surface.mate[h] == kNoIndex || surface.mate[h] > h) ++edges;
  }
  return static_cast<std::int64_t>(VertexFans(surface).first.size()) - edges +
         static_cast<std::int64_t>(surface.triangles.size());
}

std::int64_t open_edges(const ChartSurface& surface) {
  return std::count(surface.mate.begin(), surface.mate.end(), kNoIndex);
}

/// Checks of a proxy of any surface.
void check_proxy(const ChartSurface& surface, std::size_t triangles) {
  const ChartProxy proxy = chart_proxy(surface, VertexFans(surface), triangles);
  const ChartSurface& made = proxy.surface;
  EXPECT_LE(made.triangles.size(), triangles);
  EXPECT_EQ(euler_number(made), euler_number(surface));
  EXPECT_LE(open_edges(made), open_edges(surface));
  for (const double area : made.area) EXPECT_GT(area, 0);
  for (std::uint32_t h = 0; h < made.mate.size(); ++h) {
    const std::uint32_t m = made.mate[h], fine = proxy.surface_edge[h];
    EXPECT_EQ(proxy.piece[fine / 3], h / 3);
    if (m == kNoIndex) {
      EXPECT_EQ(surface.mate[fine], kNoIndex);
      continue;
    }
    EXPECT_EQ(made.mate[m], h);
    EXPECT_EQ(surface.mate[fine], proxy.surface_edge[m]);
  }
  // The links between the triangles of a piece make a tree of them.
  std::vector<std::int64_t> joints(made.triangles.size(), 1);
  for (std::uint32_t t = 0; t < proxy.piece.size(); ++t) --joints[proxy.piece[t]];
  for (std::uint32_t h = 0; h < proxy.is_inside_piece.size(); ++h) {
    const std::uint32_t m = surface.mate[h];
    if (proxy.is_inside_piece[h] == 0 || m > h) continue;
    ASSERT_EQ(proxy.piece[h / 3], proxy.piece[m / 3]);
    ++joints[proxy.piece[h / 3]];
  }
  for (const std::int64_t left : joints) EXPECT_EQ(left, 0);
}

TEST(ChartProxy, KeepsWhatTheSurfaceIs) {
  check_proxy(chart_surface(test::icosphere(4)), 300);
  check_proxy(chart_surface(test::torus(60, 40)), 400);
  check_proxy(chart_surface(test::plane(40, 30)), 200);
}

TEST(ChartProxy, PiecesEndWhereNothingIsJoined) {
  ChartSurface surface = chart_surface(test::plane(40, 30));
  const auto is_left = [&](std::uint32_t t) {
    double x = 0;
    for (const std::uint32_t v : surface.triangles[t]) x += surface.positions[v].x / 3;
    return x < 0.5;
  };
  for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
    const std::uint32_t m = surface.mate[h];
    if (m == kNoIndex || is_left(h / 3) == is_left(m / 3)) continue;
    surface.mate[h] = surface.mate[m] = kNoIndex;
  }
  EXPECT_EQ(euler_number(surface), 2);
  check_proxy(surface, 100);
  const ChartProxy proxy = chart_proxy(surface, VertexFans(surface), 100);
  std::vector<int> side(proxy.surface.triangles.size(), -1);
  for (std::uint32_t t = 0; t < proxy.piece.size(); ++t) {
    int& known = side[proxy.piece[t]];
    const int own = is_left(t) ? 1 : 0;
    EXPECT_TRUE(known == -1 || known == own);
    known = own;
  }
}

/// Waves and small bumps on a torus.
Mesh bumpy_torus(std::uint32_t slices, std::uint32_t rings) {
  Mesh mesh = test::torus(slices, rings, 1, 0.4);
  for (Vec3& p : mesh.positions) {
    const double x = p.x, y = p.y, z = p.z;
    const double bump = 0.02 * std::sin(9 * x + 2 * z) * std::sin(11 * y - 3 * x) +
                        0.004 * std::sin(50 * x) * std::sin(60 * y) * std::sin(55 * z);
    p = {static_cast<float>(x * (1 + bump)), static_cast<float>(y * (1 + bump)),
         static_cast<float>(z * (1 + bump))};
  }
  return mesh;
}

TEST(ChartProxy, LargeMeshesHaveSoundChartsAndTheSameOnAnyThreads) {
  const Mesh mesh = bumpy_torus(160, 80);
  const UnwrapOptions options{.size = 1024, .border_texels = 4};
  UnwrapReport report;
  Mesh three;
  set_thread_limit(3);
  test::check_charts(mesh, options, report, &three);
  set_thread_limit(0);
  EXPECT_LT(report.charts, 60U);
  EXPECT_GT(report.coverage, 0.6);
  const Mesh one = unwrap_charts(mesh, options, nullptr, 1);
  EXPECT_EQ(one.uvs, three.uvs);
  EXPECT_EQ(one.uv_triangles, three.uv_triangles);
}

}  // namespace
}  // namespace kiln
