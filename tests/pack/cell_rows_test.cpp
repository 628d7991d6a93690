// Rows of cells beside a plain grid: the lowest place that a mask has, for widths on both sides of a word.
#include "pack/cell_rows.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace kiln {
namespace {

/// A mask of random runs, one or two a row.
ChartMask random_mask(std::mt19937& random, std::uint32_t most) {
  ChartMask mask;
  mask.width = 1 + static_cast<std::uint32_t>(random() % most);
  mask.height = 1 + static_cast<std::uint32_t>(random() % 12);
  for (std::uint32_t row = 0; row < mask.height; ++row) {
    const auto a = static_cast<std::uint32_t>(random() % mask.width);
    const auto b = static_cast<std::uint32_t>(random() % mask.width);
    mask.runs.push_back({row, std::min(a, b), std::max(a, b)});
    if (std::max(a, b) + 2 < mask.width) mask.runs.push_back({row, mask.width - 1, mask.width - 1});
  }
  mask.sort_runs();
  return mask;
}

struct PlainGrid {
  std::uint32_t width, height;
  std::vector<std::uint8_t> taken = std::vector<std::uint8_t>(std::size_t{width} * height, 0);

  bool free(const ChartMask& mask, std::uint32_t x, std::uint32_t y) const {
    for (const ChartMask::Run& run : mask.runs) {
      for (std::uint32_t i = run.first; i <= run.last; ++i) {
        if (taken[std::size_t{y + run.row} * width + x + i] != 0) return false;
      }
    }
    return true;
  }
  std::optional<std::pair<std::uint32_t, std::uint32_t>> find(
      const ChartMask& mask, const CellRows::Window& window) const {
    for (std::uint32_t y = window.bottom; y + mask.height <= std::min(height, window.top); ++y) {
      for (std::uint32_t x = 0; x + mask.width <= width; ++x) {
        if (free(mask, x, y)) return std::pair{x, y};
      }
    }
    return std::nullopt;
  }
  void occupy(const ChartMask& mask, std::uint32_t x, std::uint32_t y) {
    for (const ChartMask::Run& run : mask.runs) {
      for (std::uint32_t i = run.first; i <= run.last; ++i) {
        taken[std::size_t{y + run.row} * width + x + i] = 1;
      }
    }
  }
};

TEST(CellRows, FindsWhatAPlainGridFinds) {
  std::mt19937 random(3);
  for (const std::uint32_t width :
       {7U, 63U, 64U, 65U, 100U, 128U, 200U, 512U, 700U, 1024U, 2048U}) {
    SCOPED_TRACE("width " + std::to_string(width));
    constexpr std::uint32_t height = 40;
    const std::uint32_t longest = std::min(width + 3, 90U);
    CellRows rows(width, height, longest);
    PlainGrid grid{width, height};
    int placed = 0, refused = 0;
    for (int i = 0; i < 200; ++i) {
      const ChartMask mask = random_mask(random, longest);
      CellRows::Window window{static_cast<std::uint32_t>(random() % (height + 5))};
      if (i % 5 == 0) window.bottom = static_cast<std::uint32_t>(random() % 8);
      const auto expected = grid.find(mask, window);
      ASSERT_EQ(rows.find(mask, window), expected) << "mask " << i;
      ++(expected ? placed : refused);
      if (!expected) continue;
      grid.occupy(mask, expected->first, expected->second);
      if (i % 3 == 0) {
        rows.mark(mask, expected->first, expected->second);
        rows.dilate(0, height, 0, width - 1);
      } else {
        rows.occupy(mask, expected->first, expected->second);
      }
    }
    EXPECT_GT(placed, 3);
    EXPECT_GT(refused, 3);
  }
}

}  // namespace
}  // namespace kiln
