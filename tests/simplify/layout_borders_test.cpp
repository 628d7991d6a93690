// LayoutBorders::free() beside its definition, over charts that are copied many times.
#include "simplify/layout_borders.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "support/shapes.h"

namespace kiln {
namespace {

double doubled(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
}

/// Triangles in cells of a grid, each a chart of its own; some are copied, mirrored or not. No others overlap.
struct CopiedCharts {
  std::vector<Vec2> uvs;
  std::vector<Triangle> corners;
  std::vector<std::uint32_t> charts;
  std::vector<int> cell_of;  ///< By UV.

  CopiedCharts(std::uint32_t side, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> inside(0.05F, 0.95F);
    for (std::uint32_t cell = 0; cell < side * side; ++cell) {
      const auto x = static_cast<float>(cell % side), y = static_cast<float>(cell / side);
      std::array<Vec2, 3> p{};
      do {
        for (Vec2& uv : p) uv = {(x + inside(random)) / side, (y + inside(random)) / side};
      } while (std::abs(doubled(p[0], p[1], p[2])) * side * side < 0.05);
      for (std::uint32_t copies = 1 + random() % 5; copies > 0; --copies) {
        const auto first = static_cast<std::uint32_t>(uvs.size());
        if (random() % 2 == 0) std::swap(p[1], p[2]);
        uvs.insert(uvs.end(), p.begin(), p.end());
        corners.push_back({first, first + 1, first + 2});
        charts.push_back(static_cast<std::uint32_t>(charts.size()));
        cell_of.insert(cell_of.end(), 3, static_cast<int>(cell));
      }
    }
  }

  /// The definition: no corner that is left, of other places than the ends of the new line, lies in the triangle.
  bool is_free(const std::vector<std::uint8_t>& left, std::uint32_t before, std::uint32_t gone,
               std::uint32_t after) const {
    const Vec2 &a = uvs[before], &b = uvs[gone], &c = uvs[after];
    const double turn = doubled(a, b, c);
    if (turn == 0) return true;
    const double sign = turn > 0 ? 1 : -1;
    for (std::uint32_t i = 0; i < uvs.size(); ++i) {
      const Vec2& p = uvs[i];
      if (left[i] == 0 || p == a || p == c) continue;
      if (p == b && cell_of[i] == cell_of[gone]) continue;  // a copy, that goes as well
      if (sign * doubled(a, b, p) >= 0 && sign * doubled(b, c, p) >= 0 &&
          sign * doubled(c, a, p) >= 0) {
        return false;
      }
    }
    return true;
  }
};

TEST(LayoutBorders, FreeIsWhatItsDefinitionSaysWhileCornersGo) {
  for (const std::uint32_t side : {1U, 3U, 9U}) {
    const CopiedCharts layout(side, side);
    const LayoutCopies copies(layout.uvs, layout.corners);
    std::vector<std::uint8_t> left(layout.uvs.size(), 1);
    LayoutBorders borders(layout.uvs, layout.corners, layout.charts, left, copies);
    std::mt19937 random(7);
    const auto any = [&] { return static_cast<std::uint32_t>(random() % layout.uvs.size()); };
    int free = 0, held = 0;
    for (int round = 0; round < 4000; ++round) {
      const std::uint32_t before = any(), gone = any(), after = any();
      const bool is_free = layout.is_free(left, before, gone, after);
      EXPECT_EQ(borders.may_remove(layout.uvs, before, gone, after), is_free)
          << before << ", " << gone << ", " << after << " in round " << round;
      ++(is_free ? free : held);
      if (round % 16 != 0) continue;
      const std::uint32_t removed = any();
      borders.remove(removed);  // a second time, it changes nothing
      left[removed] = 0;
    }
    EXPECT_GT(free, 100);
    if (side > 1) EXPECT_GT(held, 100);
  }
}

TEST(LayoutBorders, ChartsThatOverlapFromTheStartDoNotHoldEachOther) {
  // Two large triangles that cross, and a small one within the first.
  const std::vector<Vec2> uvs = {{0, 0},       {1, 0},       {0, 1},
                                 {0.1F, 0.9F}, {0.9F, 0.9F}, {0.1F, 0.1F},
                                 {0.2F, 0.2F}, {0.3F, 0.2F}, {0.2F, 0.3F}};
  const std::vector<Triangle> corners = {{0, 1, 2}, {3, 5, 4}, {6, 7, 8}};
  const LayoutCopies copies(uvs, corners);
  const LayoutBorders borders(uvs, corners, std::vector<std::uint32_t>{0, 1, 2},
                              std::vector<std::uint8_t>(uvs.size(), 1), copies);
  EXPECT_TRUE(borders.may_remove(uvs, 1, 0, 2));  // all lie in it, all overlap with it
  // A chart that overlaps none of them is held by what lies in its way.
  const std::vector<Vec2> beside = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {3, 0}, {2, 1}};
  const std::vector<Triangle> two = {{0, 1, 2}, {3, 4, 5}};
  const LayoutCopies none(beside, two);
  const LayoutBorders parted(beside, two, std::vector<std::uint32_t>{0, 1},
                             std::vector<std::uint8_t>(beside.size(), 1), none);
  EXPECT_FALSE(parted.may_remove(std::vector<Vec2>{{0, -1}, {9, 0}, {0, 9}, {2, 0}, {3, 0}, {2, 1}},
                                 1, 0, 2));
}

}  // namespace
}  // namespace kiln
