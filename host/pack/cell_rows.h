// A square of cells, taken or free, and the lowest place that a mask has in it.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "pack/outline_mask.h"

namespace kiln {

/// Rows of cells, 64 a word. Of each row all widenings to the left by a power of two are kept. So a run
/// of cells is tried at 64 places by two words.
class CellRows {
 public:
  /// \param width    cells, at most 2048
  /// \param longest  no run of a mask is longer
  CellRows(std::uint32_t width, std::uint32_t height, std::uint32_t longest = ~0U);

  /// Bounds of the search for a place.
  struct Window {
    std::uint32_t top = 0;     ///< The mask's, at most.
    std::uint32_t bottom = 0;  ///< The mask's, at least.
  };
  /// The lowest row, and in it the first cell, where the mask is free.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> find(const ChartMask& mask,
                                                              const Window& window) const;
  void take(const ChartMask& mask, std::uint32_t x, std::uint32_t y);
  /// The first step of take(), for many masks at once. Places are found again after widen() of their rows.
  void mark(const ChartMask& mask, std::uint32_t x, std::uint32_t y);
  /// The second step of take(), for rows from `first` to before `end` with marks from cell `left` to `right`.
  void widen(std::uint32_t first, std::uint32_t end, std::uint32_t left, std::uint32_t right);
  void clear();

 private:
  std::uint64_t* row(std::uint32_t level, std::uint32_t y) {
    return bits_.data() + (std::size_t{level} * height_ + y) * words_;
  }
  const std::uint64_t* row(std::uint32_t level, std::uint32_t y) const {
    return bits_.data() + (std::size_t{level} * height_ + y) * words_;
  }
  template <std::uint32_t words>
  std::optional<std::pair<std::uint32_t, std::uint32_t>> find_in(const ChartMask& mask,
                                                                 const Window& window) const;
  std::uint64_t rows_that_fit(const ChartMask& mask, std::uint32_t first) const;
  void note_longest_free(std::uint32_t y, std::uint32_t steps);
  void find_longest(std::uint32_t y);

  /// The longest run of free cells in a row. As cells are taken, it is known without a look at the row. Not where
  /// another may be longer.
  struct FreeRun {
    std::uint32_t begin = 0, end = 0;
    std::uint32_t others = 0;  ///< No other is longer than this.
    std::uint32_t length() const { return end - begin; }
    void take(std::uint32_t first, std::uint32_t last);
  };

  std::uint32_t width_, height_, words_, levels_;
  std::vector<std::uint64_t> bits_;
  // Which rows have a run of free cells that is long enough: a bit a row, for lengths in steps.
  std::uint32_t step_;  ///< Two to this power, cells.
  std::uint32_t row_words_;
  std::vector<std::uint64_t> fits_;
  std::vector<std::uint32_t> longest_free_;  ///< Longest free run of each row, in steps.
  std::vector<FreeRun> free_;                ///< And where it is, or an empty one after marks.
};

}  // namespace kiln
