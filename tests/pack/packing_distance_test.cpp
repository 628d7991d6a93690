// Rectangles and outlines lie apart, inside of the square, and not mirrored, whichever way they are packed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "pack/bitmap_packing.h"
#include "pack/box_packing.h"
#include "pack/rectangle_packing.h"

namespace kiln {
namespace {

/// \returns true if all were placed; then no cell is taken twice, and none lies outside.
bool packs(const std::vector<PackSize>& sizes, std::uint32_t side) {
  std::vector<PackPlace> places;
  if (!pack_rectangles(sizes, side, places)) return false;
  EXPECT_EQ(places.size(), sizes.size());
  std::vector<std::uint8_t> taken(std::size_t{side} * side, 0);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const std::uint32_t width = places[i].turned ? sizes[i].height : sizes[i].width;
    const std::uint32_t height = places[i].turned ? sizes[i].width : sizes[i].height;
    EXPECT_LE(places[i].x + width, side);
    EXPECT_LE(places[i].y + height, side);
    if (testing::Test::HasFailure()) return true;
    for (std::uint32_t y = places[i].y; y < places[i].y + height; ++y) {
      for (std::uint32_t x = places[i].x; x < places[i].x + width; ++x) {
        EXPECT_EQ(taken[std::size_t{y} * side + x]++, 0) << x << ", " << y << " of " << i;
      }
    }
  }
  return true;
}

TEST(RectanglePacking, NoCellIsTakenTwice) {
  std::mt19937 random(9);
  int packed = 0, refused = 0;
  for (int round = 0; round < 400 && !HasFailure(); ++round) {
    SCOPED_TRACE(round);
    const auto side = static_cast<std::uint32_t>(8 + random() % 40);
    const auto most = static_cast<std::uint32_t>(2 + random() % (side / 2));
    std::vector<PackSize> sizes;
    // From half empty to overfull.
    const double target = (0.5 + 0.02 * (round % 30)) * side * side;
    for (double area = 0; area < target;) {
      sizes.push_back({static_cast<std::uint32_t>(1 + random() % most),
                       static_cast<std::uint32_t>(1 + random() % most)});
      area += static_cast<double>(sizes.back().width) * sizes.back().height;
    }
    ++(packs(sizes, side) ? packed : refused);
  }
  EXPECT_GT(packed, 100);
  EXPECT_GT(refused, 20);
}

TEST(RectanglePacking, FillsTheSquareToTheLastCell) {
  EXPECT_TRUE(packs({{16, 16}}, 16));
  EXPECT_FALSE(packs({{17, 1}}, 16));
  EXPECT_FALSE(packs({{1, 17}}, 16));
  for (const std::uint32_t parts : {2U, 4U, 8U, 16U}) {
    SCOPED_TRACE(parts);
    EXPECT_TRUE(packs(std::vector<PackSize>(parts, {16, 16 / parts}), 16));
    EXPECT_TRUE(packs(std::vector<PackSize>(parts, {16 / parts, 16}), 16));
    EXPECT_TRUE(
        packs(std::vector<PackSize>(std::size_t{parts} * parts, {16 / parts, 16 / parts}), 16));
    EXPECT_FALSE(packs(std::vector<PackSize>(parts + 1, {16 / parts, 16}), 16));
  }
  // Shelves leave gaps; the skyline fills them: an L beside a square.
  EXPECT_TRUE(packs({{16, 4}, {4, 12}, {12, 12}}, 16));
  EXPECT_TRUE(packs({{10, 16}, {6, 6}, {6, 10}}, 16));
}

double distance_to_side(const Vec2d& p, const Vec2d& a, const Vec2d& b) {
  const Vec2d side = b - a;
  const double along = std::clamp(dot(p - a, side) / dot(side, side), 0.0, 1.0);
  const Vec2d rest = p - (a + side * along);
  return std::sqrt(dot(rest, rest));
}

/// Least distance of two convex polygons; negative where a corner of one is inside of the other.
double distance_of(const std::vector<Vec2d>& one, const std::vector<Vec2d>& other) {
  double least = HUGE_VAL;
  for (const auto& [from, to] : {std::pair(&one, &other), std::pair(&other, &one)}) {
    for (const Vec2d& p : *from) {
      bool is_inside = true;
      for (std::size_t k = 0; k < to->size(); ++k) {
        const Vec2d &a = (*to)[k], &b = (*to)[(k + 1) % to->size()];
        least = std::min(least, distance_to_side(p, a, b));
        is_inside = is_inside && cross(b - a, p - a) > 0;
      }
      if (is_inside) return -1;
    }
  }
  return least;
}

/// Triangles and quads, counter-clockwise, far from the origin as well.
std::vector<Outline> random_outlines(std::size_t count) {
  std::mt19937 random(17);
  const auto unit = [&] { return static_cast<double>(random() % 4096) / 4096; };
  std::vector<Outline> outlines;
  for (std::size_t i = 0; i < count; ++i) {
    const double width = 0.2 + unit(), height = 0.1 + 0.4 * unit(), angle = 6.3 * unit();
    const Vec2d from{4 * unit() - 2, 4 * unit() - 2};
    const auto at = [&](double x, double y) {
      return from + Vec2d{std::cos(angle) * x - std::sin(angle) * y,
                          std::sin(angle) * x + std::cos(angle) * y};
    };
    Outline outline;
    outline.rings.push_back({at(0, 0), at(width, 0), at(0.7 * width, height)});
    outline.area = width * height / 2;
    if (i % 2 == 0) {
      outline.rings[0].push_back(at(0.2 * width, height));
      outline.area += 0.25 * width * height;
    }
    outlines.push_back(outline);
  }
  return outlines;
}

void expect_apart(std::span<const Outline> outlines, const OutlinePacking& packing,
                  std::uint32_t size, double padding) {
  ASSERT_GT(packing.scale, 0);
  ASSERT_EQ(packing.places.size(), outlines.size());
  std::vector<std::vector<Vec2d>> placed;
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    const auto& [turn, shift] = packing.places[i];
    EXPECT_NEAR(dot(turn, turn), 1, 1e-9);
    std::vector<Vec2d>& ring = placed.emplace_back();
    for (const Vec2d& p : outlines[i].rings[0]) {
      ring.push_back(
          Vec2d{turn.x * p.x - turn.y * p.y, turn.y * p.x + turn.x * p.y} * packing.scale + shift);
      for (const double x : {ring.back().x, ring.back().y}) {
        EXPECT_GE(x, 0.5 * padding - 1e-6) << i;
        EXPECT_LE(x, size - 0.5 * padding + 1e-6) << i;
      }
    }
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_GE(distance_of(placed[k], ring), padding - 1e-6) << i << ' ' << k;
    }
  }
}

TEST(OutlinePacking, KeepsPaddingBetweenOutlinesAndHalfOfItAtTheSides) {
  for (const std::size_t count :
       {std::size_t{1}, std::size_t{2}, std::size_t{7}, std::size_t{101}}) {
    const std::vector<Outline> outlines = random_outlines(count);
    for (const double padding : {0.25, 4.0}) {
      SCOPED_TRACE(std::to_string(count) + " at " + std::to_string(padding));
      constexpr std::uint32_t kSize = 96;
      const OutlinePacking boxes = pack_boxes(outlines, kSize, padding);
      expect_apart(outlines, boxes, kSize, padding);
      if (count > 9 && padding < 1) continue;
      const OutlinePacking packing = pack_outlines(outlines, kSize, padding);
      expect_apart(outlines, packing, kSize, padding);
      EXPECT_GE(packing.scale, 0.95 * boxes.scale);
    }
  }
}

/// Up to 100 outlines are searched on 256 cells a side, more of them on 2,048; small maps have no more cells than texels.
TEST(OutlinePacking, MoreThanAHundredOutlinesHaveFinerCells) {
  const auto farthest_cell = [](std::size_t count, std::uint32_t size) {
    const std::vector<Outline> outlines = random_outlines(count);
    const PackState state = search_packing(outlines, size, 1, 0, 1);
    EXPECT_GT(state.share, 0) << count;
    return *std::max_element(state.packed.x.begin(), state.packed.x.end());
  };
  EXPECT_LT(farthest_cell(100, 4096), 256U);
  EXPECT_GT(farthest_cell(100, 4096), 160U);
  EXPECT_GT(farthest_cell(101, 4096), 1280U);
  EXPECT_LT(farthest_cell(20, 64), 64U);
}

/// A search goes on from a state: nothing is lost, for outlines that grew a little as well.
TEST(OutlinePacking, ContinuesFromAKnownState) {
  std::vector<Outline> outlines = random_outlines(14);
  constexpr std::uint32_t kSize = 128;
  const PackState first = search_packing(outlines, kSize, 2, 40, 1);
  ASSERT_GT(first.share, 0);
  EXPECT_GE(search_packing(outlines, kSize, 2, 0, 1, &first).share, first.share * (1 - 1e-9));
  const OutlinePacking packing = pack_outlines(outlines, kSize, 2, &first);
  expect_apart(outlines, packing, kSize, 2);
  EXPECT_GE(packing.scale * packing.scale * AtlasPacker(outlines, kSize, 2).area(),
            0.97 * first.share * kSize * kSize);
  // One that is half as wide again no longer fits at this scale.
  for (Vec2d& p : outlines[3].rings[0]) p = p * 1.5;
  outlines[3].area *= 2.25;
  const PackState grown = search_packing(outlines, kSize, 2, 0, 1, &first);
  EXPECT_GT(grown.share, 0.85 * first.share);
  expect_apart(outlines, pack_outlines(outlines, kSize, 2, &first), kSize, 2);
}

}  // namespace
}  // namespace kiln
