// Layouts of very many charts and of torn surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "kiln/unwrap.h"
#include "pack/bitmap_packing.h"
#include "pack/box_packing.h"
#include "support/shapes.h"
#include "unwrap/charts_check.h"
#include "unwrap/unwrap_charts.h"

namespace kiln {
namespace {

using test::check_charts;
using test::LayoutFacts;

double share(std::mt19937& random) { return static_cast<double>(random() % 4096) / 4096; }

/// Triangles of many shapes and sizes.
std::vector<Outline> random_triangles(std::size_t count) {
  std::mt19937 random(11);
  std::vector<Outline> outlines(count);
  for (Outline& outline : outlines) {
    const double size = 0.2 + share(random), angle = 6 * share(random);
    const Vec2d along{size * std::cos(angle), size * std::sin(angle)};
    const Vec2d up{-along.y * (0.3 + share(random)), along.x * (0.3 + share(random))};
    outline.rings = {{{0, 0}, along, along * share(random) + up}};
    outline.area = 0.5 * std::abs(cross(along, outline.rings[0][2]));
  }
  return outlines;
}

TEST(ManyCharts, AreDenserThanTheirBoxesAndTheSameOnAllThreads) {
  for (const std::size_t count : {60, 1010}) {
    const std::vector<Outline> outlines = random_triangles(count);
    const OutlinePacking many = pack_outlines(outlines, 512, 2, nullptr, 3),
                         boxes = pack_boxes(outlines, 512, 2);
    EXPECT_GT(many.scale, 1.1 * boxes.scale) << count;
    const OutlinePacking one = pack_outlines(outlines, 512, 2, nullptr, 1);
    EXPECT_EQ(one.scale, many.scale);
    ASSERT_EQ(one.places.size(), many.places.size());
    for (std::size_t i = 0; i < one.places.size(); ++i) {
      EXPECT_EQ(one.places[i].shift.x, many.places[i].shift.x);
      EXPECT_EQ(one.places[i].shift.y, many.places[i].shift.y);
    }
  }
}

/// Single triangles, none beside another.
Mesh scraps(std::uint32_t count) {
  Mesh mesh;
  mesh.name = "scraps";
  std::mt19937 random(7);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto at = static_cast<std::uint32_t>(mesh.positions.size());
    for (int k = 0; k < 3; ++k) {
      mesh.positions.push_back({static_cast<float>(share(random)),
                                static_cast<float>(share(random)), static_cast<float>(i)});
    }
    mesh.triangles.push_back({at, at + 1, at + 2});
  }
  return mesh;
}

TEST(ManyCharts, ScrapsKeepTheirDistance) {
  UnwrapReport report;
  const LayoutFacts few = check_charts(scraps(100), {.size = 1024, .border_texels = 4}, report);
  EXPECT_EQ(few.charts, 100u);
  EXPECT_GT(few.coverage, 0.6);
  const LayoutFacts many = check_charts(scraps(1010), {.size = 1024, .border_texels = 2}, report);
  EXPECT_EQ(many.charts, 1010u);
  EXPECT_GT(many.coverage, 0.6);
}

TEST(ManyCharts, HaveTexelsOfSmallMaps) {
  const Mesh mesh = scraps(700);
  UnwrapReport report;
  unwrap(mesh, {.size = 32, .border_texels = 1}, &report);
  EXPECT_GT(report.charts, 600u);
  EXPECT_GT(report.coverage, 0.05);
}

TEST(ManyCharts, KnownOnesOfAnotherSizeChangeNothing) {
  // The charts of the first do not depend on the size; those of the second may.
  Mesh parts;
  parts.name = "parts";
  for (std::uint32_t i = 0; i < 30; ++i) {
    const std::uint32_t at = 4 * i;
    const auto z = static_cast<float>(i);
    for (const Vec3& p : {Vec3{0, 0, z}, Vec3{1, 0, z}, Vec3{0, 1, z}, Vec3{0, 0, z + 0.7F}})
      parts.positions.push_back(p);
    for (const Triangle& t :
         {Triangle{0, 2, 1}, Triangle{0, 1, 3}, Triangle{1, 2, 3}, Triangle{0, 3, 2}})
      parts.triangles.push_back({at + t[0], at + t[1], at + t[2]});
  }
  for (const Mesh& mesh : {parts, test::torus(24, 12)}) {
    KnownCharts known;
    for (const UnwrapOptions& options : {UnwrapOptions{.size = 512, .border_texels = 2},
                                         UnwrapOptions{.size = 256, .border_texels = 4}}) {
      const Mesh fresh = unwrap_charts(mesh, options, nullptr);
      const Mesh again = unwrap_charts(mesh, options, nullptr, 0, nullptr, &known);
      EXPECT_EQ(again.uvs, fresh.uvs) << mesh.name << options.size;
      EXPECT_EQ(again.uv_triangles, fresh.uv_triangles) << mesh.name << options.size;
    }
  }
}

TEST(ManyCharts, SheetsThatCrossGoOn) {
  // Two sheets of two squares each, through one edge.
  Mesh mesh;
  mesh.name = "cross";
  mesh.positions = {{0, 0, 0},  {0, 0, 1}, {1, 0, 0}, {1, 0, 1},  {-1, 0, 0},
                    {-1, 0, 1}, {0, 1, 0}, {0, 1, 1}, {0, -1, 0}, {0, -1, 1}};
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 0, 1}, {4, 1, 5},
                    {0, 6, 7}, {0, 7, 1}, {8, 0, 1}, {8, 1, 9}};
  UnwrapReport report;
  EXPECT_EQ(check_charts(mesh, {.size = 256, .border_texels = 4}, report).charts, 2u);
}

TEST(ManyCharts, ASlitNarrowerThanUvsAreRoundedStaysInItsChart) {
  // A sheet of 8 x 8 squares, slit from one side to the middle along y = 0.
  constexpr std::uint32_t kSide = 8;
  constexpr float kNarrow = 2e-8F;
  Mesh mesh;
  mesh.name = "slit";
  const auto add = [&](float x, float y) { mesh.positions.push_back({x, y, 0}); };
  for (std::uint32_t j = 0; j <= kSide; ++j) {
    for (std::uint32_t i = 0; i <= kSide; ++i) {
      add(static_cast<float>(i) / kSide, static_cast<float>(j) / kSide - 0.5F);
    }
  }
  const std::uint32_t middle = kSide / 2, lower = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t i = 0; i < middle; ++i) {
    add(static_cast<float>(i) / kSide, -kNarrow);
    mesh.positions[middle * (kSide + 1) + i].y = kNarrow;
  }
  for (std::uint32_t j = 0; j < kSide; ++j) {
    const auto at = [&](std::uint32_t i, std::uint32_t row) {
      const bool below = row == middle && j + 1 == middle && i < middle;
      return below ? lower + i : row * (kSide + 1) + i;
    };
    for (std::uint32_t i = 0; i < kSide; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  UnwrapReport report;
  EXPECT_EQ(check_charts(mesh, {.size = 256, .border_texels = 2}, report).charts, 1u);
}

}  // namespace
}  // namespace kiln
