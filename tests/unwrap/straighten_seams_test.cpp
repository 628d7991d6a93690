// Seams are straightened: shorter, no vertex more, every chart a disc and injective.
#include "unwrap/straighten_seams.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "support/shapes.h"
#include "unwrap/pairing.h"

namespace kiln {
namespace {

struct Laid {
  ChartSurface surface;
  ChartBorders borders;
  std::vector<FlatChart> charts;

  explicit Laid(const Mesh& mesh) : surface(chart_surface(mesh)), borders(surface) {}

  double seam() const {
    double sum = 0;
    for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
      if (surface.mate[h] < h && !borders.is_glued(h)) sum += surface.length[h];
    }
    return sum;
  }
  std::size_t vertices() const {
    std::size_t sum = 0;
    for (const FlatChart& chart : charts) sum += chart.points.size();
    return sum;
  }
  void check() const {
    std::vector<int> seen(surface.triangles.size(), 0);
    for (const FlatChart& chart : charts) {
      EXPECT_TRUE(is_injective(chart));
      EXPECT_LE(distortion(chart).max_stretch, ChartLimits{}.max_stretch * (1 + 1e-9));
      EXPECT_EQ(2 * chart.points.size(), 2 + chart.triangles.size() + chart.boundary.size());
      for (const std::uint32_t t : chart.source) ++seen[t];
    }
    for (const int count : seen) EXPECT_EQ(count, 1);
  }
};

/// A sheet in its plane, cut in two along a line of teeth: the diagonals of one column.
TEST(ChartTrims, TeethOfASheetGo) {
  constexpr std::uint32_t side = 12;
  Mesh mesh = test::plane(side, side, 1, 1);
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  Laid laid(mesh);
  std::array<std::vector<std::uint32_t>, 2> parts;
  // The centre's place in the sheet; the line runs through a column's diagonals and rungs.
  const auto part_of = [&](std::uint32_t t) {
    double x = 0;
    for (const std::uint32_t v : laid.surface.triangles[t]) x += laid.surface.positions[v].x / 3;
    return x * side < side / 2 + 0.5 ? 0U : 1U;
  };
  for (std::uint32_t t = 0; t < laid.surface.triangles.size(); ++t) parts[part_of(t)].push_back(t);
  for (std::uint32_t h = 0; h < laid.surface.mate.size(); ++h) {
    const std::uint32_t mate = laid.surface.mate[h];
    if (mate != kNoIndex && part_of(h / 3) == part_of(mate / 3)) laid.borders.set_glued(h, true);
  }
  std::vector<std::uint32_t> local(laid.surface.triangles.size());
  for (const auto& part : parts) {
    FlatChart chart = cut_open(laid.surface, part, laid.borders.glued(), local);
    project_to_mean_plane(chart, laid.surface);
    ASSERT_TRUE(is_injective(chart));
    laid.charts.push_back(std::move(chart));
  }
  const double before = laid.seam();
  trim_charts(laid.surface, laid.borders, {}, laid.charts);
  laid.check();
  // A step at the sheet's border may stay; the shortest line has length 1.
  EXPECT_GT(before, 2 * laid.seam());
  EXPECT_GE(laid.seam(), 1 - 1e-6);
  EXPECT_LT(laid.seam(), 1.05);
}

TEST(ChartTrims, GrownChartsGetShorterSeams) {
  for (const std::uint32_t seed : {1U, 2U, 3U, 4U}) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Mesh mesh = seed % 2 == 0 ? test::icosphere(3) : test::torus(40, 20);
    mesh.uvs.clear();
    mesh.uv_triangles.clear();
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    for (Vec3& p : mesh.positions) {
      for (float* axis : {&p.x, &p.y, &p.z}) {
        *axis += 0.02F * static_cast<float>(random() % 1000) / 1000;
      }
    }
    Laid laid(mesh);
    laid.charts = grow_charts(laid.surface, laid.borders, {0.02, 1.8});
    laid.check();
    const double seam = laid.seam();
    const std::size_t vertices = laid.vertices();
    trim_charts(laid.surface, laid.borders, {}, laid.charts);
    laid.check();
    EXPECT_LT(laid.seam(), seam);
    EXPECT_LE(laid.vertices(), vertices);
  }
}

}  // namespace
}  // namespace kiln
