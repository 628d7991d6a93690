// Pressing outlines into a sheet, against cells that are counted one by one.
#include "lowpoly/packing_press.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace kiln {
namespace {

/// A star of random radii: mostly not convex.
Outline blob(double radius, std::mt19937& random) {
  Outline outline;
  std::vector<FlatPoint> ring;
  for (int i = 0; i < 12; ++i) {
    const double angle = i * std::numbers::pi / 6;
    const double r = radius * (0.6 + 0.4 * static_cast<double>(random() % 1000) / 1000);
    ring.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  for (std::size_t i = 0; i < ring.size(); ++i) {
    outline.area += 0.5 * cross(ring[i], ring[(i + 1) % ring.size()]);
  }
  outline.rings.push_back(std::move(ring));
  return outline;
}

std::vector<Outline> blobs(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Outline> outlines;
  for (std::size_t i = 0; i < count; ++i) {
    outlines.push_back(blob(0.5 + static_cast<double>(random() % 100) / 100, random));
  }
  return outlines;
}

/// Cells that more than one outline takes, or that are outside; each outline must have a place.
std::size_t faults(const Sheet& sheet, const Packed& packed) {
  std::vector<int> taken(std::size_t{sheet.cells} * sheet.cells, 0);
  std::size_t count = 0;
  for (std::size_t i = 0; i < packed.turn.size(); ++i) {
    if (packed.turn[i] < 0) return sheet.cells;
    const ChartMask& mask =
        sheet.masks[i * ChartSheets::kTurns + static_cast<std::size_t>(packed.turn[i])];
    for (const ChartMask::Run& run : mask.runs) {
      for (std::uint32_t x = run.first; x <= run.last; ++x) {
        const std::size_t at_x = packed.x[i] + x, at_y = packed.y[i] + run.row;
        if (at_x >= sheet.cells || at_y >= sheet.cells) {
          ++count;
        } else if (++taken[at_y * sheet.cells + at_x] == 2) {
          ++count;
        }
      }
    }
  }
  return count;
}

/// Scale at which outlines cover a share of the sheet.
double scale_for(const ChartSheets& sheets, std::uint32_t cells, double share) {
  return std::sqrt(share / sheets.area()) * cells;
}

/// All in the middle, one over the other.
Packed heap(const Sheet& sheet, std::size_t count) {
  Packed packed;
  packed.turn.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const ChartMask& mask = sheet.masks[i * ChartSheets::kTurns];
    packed.x.push_back((sheet.cells - mask.width) / 2);
    packed.y.push_back((sheet.cells - mask.height) / 2);
  }
  return packed;
}

TEST(PackingPress, HeapsAreSpreadUntilNoneOverlaps) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<Outline> outlines = blobs(12, seed);
    const ChartSheets sheets(outlines, 512, 4);
    const Sheet sheet = sheets.draw(128, scale_for(sheets, 128, 0.5));
    const Packed start = heap(sheet, outlines.size());
    ASSERT_GT(faults(sheet, start), 0u);
    std::mt19937 random(seed);
    PackingPress press(sheets, sheet, 24, random);
    ASSERT_TRUE(press.begin(sheet, start));
    ASSERT_TRUE(press.run(3000));
    const Packed packed = press.packed();
    EXPECT_EQ(faults(sheet, packed), 0u);
    EXPECT_TRUE(packed.refused.empty());
    EXPECT_EQ(packed.places.size(), outlines.size());
  }
}

TEST(PackingPress, OutlinesWithoutRandomPlacesKeepTheirTurn) {
  const std::vector<Outline> outlines = blobs(9, 7);
  const ChartSheets sheets(outlines, 512, 4);
  const Sheet small = sheets.draw(128, scale_for(sheets, 128, 0.4));
  std::mt19937 random(1);
  PackingPress spread(sheets, small, 24, random);
  ASSERT_TRUE(spread.begin(small, heap(small, outlines.size())));
  ASSERT_TRUE(spread.run(3000));
  const Packed before = spread.packed();
  const Sheet large = sheets.draw(256, scale_for(sheets, 256, 0.41));
  PackingPress press(sheets, large, 0, random);
  ASSERT_TRUE(press.begin(small, before));
  ASSERT_TRUE(press.run(1000));
  EXPECT_EQ(press.packed().turn, before.turn);
  EXPECT_EQ(faults(large, press.packed()), 0u);
}

TEST(PackingPress, WhatCannotFitIsSaid) {
  const std::vector<Outline> outlines = blobs(6, 3);
  const ChartSheets sheets(outlines, 512, 4);
  const Sheet sheet = sheets.draw(64, scale_for(sheets, 64, 0.98));
  std::mt19937 random(1);
  PackingPress press(sheets, sheet, 24, random);
  ASSERT_TRUE(press.begin(sheet, heap(sheet, outlines.size())));
  EXPECT_FALSE(press.run(300));
  // An outline that is larger than the sheet.
  const Sheet huge = sheets.draw(64, scale_for(sheets, 64, 40));
  PackingPress hopeless(sheets, huge, 24, random);
  Packed zero;
  zero.turn.assign(outlines.size(), 0);
  zero.x.assign(outlines.size(), 0), zero.y = zero.x;
  EXPECT_FALSE(hopeless.begin(huge, zero));
}

}  // namespace
}  // namespace kiln
