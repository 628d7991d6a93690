// Outlines placed one after another, beside a plain grid on which every rotation and cell is tried.
#include "pack/atlas_bitmap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <tuple>
#include <vector>

namespace kiln {
namespace {

constexpr std::uint32_t kCells = 64;

Outline rectangle(double width, double height) {
  return {{{{0, 0}, {width, 0}, {width, height}, {0, height}}}, width * height};
}

/// Rectangles and triangles of random sizes.
std::vector<Outline> random_outlines(std::uint32_t seed, std::size_t count, double most) {
  std::mt19937 random(seed);
  const auto side = [&] {
    return most * (0.1 + 0.9 * static_cast<double>(random() % 4096) / 4096);
  };
  std::vector<Outline> outlines;
  for (std::size_t i = 0; i < count; ++i) {
    const double width = side(), height = side();
    if (i % 3 == 2) {
      outlines.push_back({{{{0, 0}, {width, 0}, {width / 3, height}}}, width * height / 2});
    } else {
      outlines.push_back(rectangle(width, height));
    }
  }
  return outlines;
}

PackOrder by_index(std::size_t count) {
  PackOrder order{std::vector<std::uint32_t>(count), std::vector<std::int8_t>(count, -1)};
  std::iota(order.order.begin(), order.order.end(), 0U);
  return order;
}

/// Each outline where its top is lowest; among these the leftmost place, then the first rotation.
PackedOutlines pack_plainly(const AtlasPacker& packer, const AtlasBitmap& sheet,
                            const PackOrder& order) {
  std::vector<bool> taken(std::size_t{sheet.cells} * sheet.cells);
  PackedOutlines packed;
  const std::size_t count = packer.outlines().size();
  packed.turn.assign(count, -1);
  packed.x.assign(count, 0), packed.y.assign(count, 0);
  for (const std::uint32_t i : order.order) {
    std::optional<std::tuple<std::uint32_t, std::uint32_t, int>> best;
    for (int turn = 0; turn < static_cast<int>(AtlasPacker::kRotations); ++turn) {
      const ChartMask& mask = sheet.mask(i, static_cast<std::int8_t>(turn));
      if (mask.runs.empty() || (order.turn[i] >= 0 && turn != order.turn[i])) continue;
      bool found = false;
      for (std::uint32_t y = 0; !found && y + mask.height <= sheet.cells; ++y) {
        for (std::uint32_t x = 0; !found && x + mask.width <= sheet.cells; ++x) {
          found = std::none_of(mask.runs.begin(), mask.runs.end(), [&](const ChartMask::Run& run) {
            const auto row = taken.begin() + static_cast<std::ptrdiff_t>(
                                                 std::size_t{y + run.row} * sheet.cells + x);
            return std::find(row + run.first, row + run.last + 1, true) != row + run.last + 1;
          });
          if (!found) continue;
          const std::tuple place{y + mask.height, x, turn};
          if (!best || place < *best) best = place;
        }
      }
    }
    if (!best) {
      packed.left_out_outlines.push_back(i);
      packed.left_out_area += packer.outlines()[i].area;
      continue;
    }
    const auto [top, x, turn] = *best;
    const ChartMask& mask = sheet.mask(i, static_cast<std::int8_t>(turn));
    packed.turn[i] = static_cast<std::int8_t>(turn);
    packed.x[i] = x, packed.y[i] = top - mask.height;
    packed.height = std::max(packed.height, top);
    packed.height_weight += packer.outlines()[i].area * top;
    for (const ChartMask::Run& run : mask.runs) {
      for (std::uint32_t c = run.first; c <= run.last; ++c) {
        taken[std::size_t{packed.y[i] + run.row} * sheet.cells + x + c] = true;
      }
    }
  }
  return packed;
}

void expect_same(const PackedOutlines& got, const PackedOutlines& wanted) {
  EXPECT_EQ(got.turn, wanted.turn);
  EXPECT_EQ(got.x, wanted.x);
  EXPECT_EQ(got.y, wanted.y);
  EXPECT_EQ(got.height, wanted.height);
  EXPECT_EQ(got.left_out_outlines, wanted.left_out_outlines);
  EXPECT_DOUBLE_EQ(got.left_out_area, wanted.left_out_area);
  EXPECT_DOUBLE_EQ(got.height_weight, wanted.height_weight);
}

TEST(AtlasPacker, PlacesEachOutlineWhereItsTopIsLowest) {
  // The last two are too many for the sheet.
  for (const double most : {12.0, 24.0, 48.0}) {
    SCOPED_TRACE(most);
    const std::vector<Outline> outlines = random_outlines(3, 14, most);
    const AtlasPacker packer(outlines, 2 * kCells, 4);
    const AtlasBitmap sheet = packer.draw(kCells, 1);
    const PackOrder order = by_index(outlines.size());
    const PackedOutlines wanted = pack_plainly(packer, sheet, order);
    EXPECT_EQ(wanted.left_out_outlines.empty(), most < 24);
    const PackedOutlines packed = packer.pack(sheet, order);
    expect_same(packed, wanted);
    // A cell is two texels; rotation and margin are the mask's.
    for (std::uint32_t i = 0; i < outlines.size(); ++i) {
      if (packed.turn[i] < 0) continue;
      const ChartMask& mask = sheet.mask(i, packed.turn[i]);
      EXPECT_EQ(packed.places[i].turn.x, mask.turn.x);
      EXPECT_EQ(packed.places[i].turn.y, mask.turn.y);
      EXPECT_DOUBLE_EQ(packed.places[i].shift.x, 2 * (packed.x[i] + mask.shift.x));
      EXPECT_DOUBLE_EQ(packed.places[i].shift.y, 2 * (packed.y[i] + mask.shift.y));
    }
  }
}

/// Rotations of an earlier result are tried first, and save time alone.
TEST(AtlasPacker, AnEarlierResultDecidesNothing) {
  const std::vector<Outline> outlines = random_outlines(7, 12, 30);
  const AtlasPacker packer(outlines, kCells, 2);
  const AtlasBitmap sheet = packer.draw(kCells, 1);
  PackOrder order = by_index(outlines.size());
  const PackedOutlines wanted = packer.pack(sheet, order);
  for (std::int8_t turn = -1; turn < static_cast<std::int8_t>(AtlasPacker::kRotations); ++turn) {
    PackedOutlines done = wanted;
    done.turn.assign(outlines.size(), turn);
    expect_same(packer.pack(sheet, order, 1e9, &done), wanted);
  }
  // But for the first outlines that are to stay.
  for (const std::size_t same : {std::size_t{1}, std::size_t{5}, outlines.size()}) {
    expect_same(packer.pack(sheet, order, 1e9, &wanted, same), wanted);
  }
  PackOrder turned = order;
  std::reverse(turned.order.begin() + 5, turned.order.end());
  const PackedOutlines other = packer.pack(sheet, turned, 1e9, &wanted, 5);
  expect_same(other, pack_plainly(packer, sheet, turned));
}

TEST(AtlasPacker, KeepsAFixedRotation) {
  const std::vector<Outline> outlines = random_outlines(5, 6, 30);
  const AtlasPacker packer(outlines, kCells, 2);
  const AtlasBitmap sheet = packer.draw(kCells, 1);
  PackOrder order = by_index(outlines.size());
  for (const std::int8_t turn : {0, 3, 8, 15}) {
    order.turn.assign(outlines.size(), turn);
    const PackedOutlines packed = packer.pack(sheet, order);
    for (const std::int8_t used : packed.turn) EXPECT_TRUE(used == turn || used == -1);
    expect_same(packed, pack_plainly(packer, sheet, order));
  }
}

TEST(AtlasPacker, StopsOnceTooMuchIsLeftOut) {
  // One fills the sheet; of the others none fits.
  const std::vector<Outline> outlines(5, rectangle(kCells, kCells));
  const AtlasPacker packer(outlines, kCells, 0, std::vector<double>(5, 0.0));
  const AtlasBitmap sheet = packer.draw(kCells, 1);
  const double area = kCells * kCells;
  EXPECT_EQ(packer.area(), 5 * area);
  for (const auto& [most, left_out] :
       {std::pair(0.0, 1U), std::pair(area, 2U), std::pair(2.5 * area, 3U), std::pair(1e9, 4U)}) {
    const PackedOutlines packed = packer.pack(sheet, by_index(5), most);
    EXPECT_EQ(packed.left_out_outlines.size(), left_out) << most;
    EXPECT_EQ(packed.left_out_area, left_out * area) << most;
  }
}

/// All of the 16 rotations for the 12 largest outlines, 8 for the next 20, and quarter turns for all others.
TEST(AtlasPacker, LargeOutlinesHaveMoreRotations) {
  std::vector<Outline> outlines;
  for (int i = 0; i < 40; ++i) outlines.push_back(rectangle(1 + (i * 17) % 40, 1));
  const AtlasPacker packer(outlines, kCells, 0);
  const AtlasBitmap sheet = packer.draw(kCells, 0.5);
  for (std::uint32_t i = 0; i < 40; ++i) {
    const std::uint32_t larger = 40 - static_cast<std::uint32_t>(outlines[i].area);
    const std::uint32_t rotations = larger < 12 ? 16 : larger < 32 ? 8 : 4;
    EXPECT_EQ(packer.rotation_count(i), rotations) << outlines[i].area;
    for (std::uint32_t turn = 0; turn < 16; ++turn) {
      const ChartMask& mask = sheet.mask(i, static_cast<std::int8_t>(turn));
      ASSERT_EQ(mask.runs.empty(), turn % (16 / rotations) != 0) << i << ' ' << turn;
      if (mask.runs.empty()) continue;
      const double angle = packer.angles()[i] + turn * std::numbers::pi / 8;
      EXPECT_NEAR(mask.turn.x, std::cos(angle), 1e-12);
      EXPECT_NEAR(mask.turn.y, std::sin(angle), 1e-12);
    }
  }
}

}  // namespace
}  // namespace kiln
