// Layouts of very many charts and of torn surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "lowpoly/box_packing.h"
#include "lowpoly/charts_check.h"
#include "lowpoly/many_packing.h"

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
    const FlatPoint along{size * std::cos(angle), size * std::sin(angle)};
    const FlatPoint up{-along.y * (0.3 + share(random)), along.x * (0.3 + share(random))};
    outline.rings = {{{0, 0}, along, along * share(random) + up}};
    outline.area = 0.5 * std::abs(cross(along, outline.rings[0][2]));
  }
  return outlines;
}

TEST(ManyCharts, AreDenserThanTheirBoxes) {
  const std::vector<Outline> outlines = random_triangles(400);
  const OutlinePacking many = pack_many(outlines, 1024, 4), boxes = pack_boxes(outlines, 1024, 4);
  EXPECT_GT(many.scale, 1.1 * boxes.scale);
}

TEST(ManyCharts, ThreadsChangeNothing) {
  const std::vector<Outline> outlines = random_triangles(150);
  const OutlinePacking one = pack_many(outlines, 512, 2, 1), two = pack_many(outlines, 512, 2, 2);
  EXPECT_EQ(one.scale, two.scale);
  ASSERT_EQ(one.places.size(), two.places.size());
  for (std::size_t i = 0; i < one.places.size(); ++i) {
    EXPECT_EQ(one.places[i].shift.x, two.places[i].shift.x);
    EXPECT_EQ(one.places[i].shift.y, two.places[i].shift.y);
  }
}

TEST(ManyCharts, ScrapsKeepTheirDistance) {
  Mesh mesh;
  mesh.name = "scraps";
  std::mt19937 random(7);
  for (std::uint32_t i = 0; i < 300; ++i) {
    const auto at = static_cast<std::uint32_t>(mesh.positions.size());
    for (int k = 0; k < 3; ++k) {
      mesh.positions.push_back({static_cast<float>(share(random)),
                                static_cast<float>(share(random)), static_cast<float>(i)});
    }
    mesh.triangles.push_back({at, at + 1, at + 2});
  }
  UnwrapReport report;
  const LayoutFacts facts = check_charts(mesh, {.size = 1024, .border_texels = 4}, report);
  EXPECT_EQ(facts.charts, 300u);
  EXPECT_GT(facts.coverage, 0.6);
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
