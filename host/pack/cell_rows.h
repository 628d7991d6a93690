// An occupancy bitmap with the search for the lowest free place of a mask.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "pack/outline_mask.h"

namespace kiln {

/// Occupied cells as rows of 64-bit words. For each power of two, a copy of every row is dilated to the left by that
/// length. A run of any length is the union of two runs whose length is a power of two, so two words of these copies
/// test it at 64 places at once.
class CellRows {
 public:
  /// \param width    width in cells, at most 2048
  /// \param longest  upper bound of the run lengths of all masks, in cells
  CellRows(std::uint32_t width, std::uint32_t height, std::uint32_t longest = ~0U);

  /// Bounds of the search for a place.
  struct Window {
    std::uint32_t top = 0;     ///< Exclusive upper bound of the mask's top row
    std::uint32_t bottom = 0;  ///< Lowest allowed row of the mask
  };
  /// The first free place of the mask, by row, then by cell; returned as {cell, row}.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> find(const ChartMask& mask,
                                                              const Window& window) const;
  void occupy(const ChartMask& mask, std::uint32_t x, std::uint32_t y);
  /// First step of occupy(): marks the cells. It is a separate function so that several masks can be marked before the
  /// rows are dilated. find() must not be called before dilate() of the changed rows.
  void mark(const ChartMask& mask, std::uint32_t x, std::uint32_t y);
  /// Second step of occupy(): updates the dilated copies of rows [first, end) with new marks in cells [left, right].
  void dilate(std::uint32_t first, std::uint32_t end, std::uint32_t left, std::uint32_t right);
  void clear();

 private:
  std::uint64_t* row(std::uint32_t level, std::uint32_t y) {
    return bits_.data() + (std::size_t{level} * height_ + y) * words_;
  }
  const std::uint64_t* row(std::uint32_t level, std::uint32_t y) const {
    return bits_.data() + (std::size_t{level} * height_ + y) * words_;
  }
  template <std::uint32_t words>
  std::optional<std::pair<std::uint32_t, std::uint32_t>> find_place(const ChartMask& mask,
                                                                    const Window& window) const;
  std::uint64_t find_rows_with_room(const ChartMask& mask, std::uint32_t first) const;
  void update_longest_free(std::uint32_t y, std::uint32_t steps);
  void find_longest_run(std::uint32_t y);

  /// The longest run of free cells in a row. When cells are occupied, it is updated without a scan of the row; the row
  /// is scanned only if another run may be longer now.
  struct FreeRun {
    std::uint32_t begin = 0, end = 0;
    /// Upper bound of the lengths of all other runs in the row
    std::uint32_t max_other_length = 0;
    std::uint32_t length() const { return end - begin; }
    void occupy(std::uint32_t first, std::uint32_t last);
  };

  std::uint32_t width_, height_, words_, levels_;
  std::vector<std::uint64_t> bits_;
  std::uint32_t step_;  ///< The unit of free lengths is 2^step_ cells
  std::uint32_t row_words_;
  // For each length, in units of 2^step_ cells, one bit per row: 1 if the row has a free run of at least that length
  std::vector<std::uint64_t> fits_;
  std::vector<std::uint32_t> longest_free_;  ///< Longest free run of each row, in steps
  std::vector<FreeRun> free_;                ///< Longest free run of each row, in cells
};

}  // namespace kiln
