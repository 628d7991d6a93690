// Masks of outlines: what they cover, and what quarter turns of one are.
#include "pack/outline_mask.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <utility>

namespace kiln {
namespace {

/// A star of random radii: one ring, in order.
Outline star(std::mt19937& random) {
  const auto unit = [&] { return static_cast<double>(random() % 65536) / 65536; };
  const int corners = 3 + static_cast<int>(random() % 40);
  const double reach = 1 + 200 * unit() * unit();
  Outline outline;
  outline.rings.emplace_back();
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners, radius = reach * (0.1 + 0.9 * unit());
    outline.rings[0].push_back({radius * std::cos(angle), 0.6 * radius * std::sin(angle)});
  }
  return outline;
}

using CellSet = std::set<std::pair<std::uint32_t, std::uint32_t>>;

/// Columns and rows that are set; runs lie inside, and none twice.
CellSet cells_of(const ChartMask& mask) {
  CellSet cells;
  for (const ChartMask::Run& run : mask.runs) {
    EXPECT_LE(run.first, run.last);
    EXPECT_LT(run.last, mask.width);
    EXPECT_LT(run.row, mask.height);
    for (std::uint32_t x = run.first; x <= run.last; ++x) {
      EXPECT_TRUE(cells.insert({x, run.row}).second);
    }
  }
  return cells;
}

/// True if every place of the outline, and around it within the margin, lies in a cell that is set.
void expect_covers(const ChartMask& mask, const Outline& outline, double scale, double margin) {
  const CellSet cells = cells_of(mask);
  const auto& ring = outline.rings[0];
  for (std::size_t i = 0; i < ring.size(); ++i) {
    for (const double along : {0.0, 0.3, 0.7}) {
      const Vec2d p = (ring[i] + (ring[(i + 1) % ring.size()] - ring[i]) * along) * scale;
      const Vec2d at{mask.turn.x * p.x - mask.turn.y * p.y + mask.shift.x,
                     mask.turn.y * p.x + mask.turn.x * p.y + mask.shift.y};
      for (int k = 0; k < 8; ++k) {
        const double angle = k * std::numbers::pi / 4, reach = margin * (1 - 1e-9);
        const double x = at.x + reach * std::cos(angle), y = at.y + reach * std::sin(angle);
        const std::pair cell{static_cast<std::uint32_t>(std::max(0.0, std::floor(x))),
                             static_cast<std::uint32_t>(std::max(0.0, std::floor(y)))};
        ASSERT_TRUE(cells.count(cell) != 0) << x << ", " << y;
      }
    }
  }
}

TEST(ChartMask, QuarterTurnsAreTheSameCellsTurned) {
  std::mt19937 random(5);
  for (int i = 0; i < 80; ++i) {
    SCOPED_TRACE(i);
    const Outline outline = star(random);
    const double angle = 0.001 * static_cast<double>(random() % 6283);
    const double margin = 0.01 * static_cast<double>(1 + random() % 300);
    const auto masks = make_turned_masks(outline, angle, 0.9, margin);
    for (std::size_t quarter = 0; quarter < 4; ++quarter) {
      expect_covers(masks[quarter], outline, 0.9, margin);
      if (quarter == 0) continue;
      const ChartMask& last = masks[quarter - 1];
      ASSERT_EQ(masks[quarter].width, last.height);
      ASSERT_EQ(masks[quarter].height, last.width);
      CellSet turned;
      for (const auto& [x, y] : cells_of(last)) turned.insert({last.height - 1 - y, x});
      ASSERT_EQ(cells_of(masks[quarter]), turned);
    }
  }
}

}  // namespace
}  // namespace kiln
