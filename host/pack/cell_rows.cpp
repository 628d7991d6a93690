#include "pack/cell_rows.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

#include "base/vectors.h"

namespace kiln {
namespace {

constexpr std::uint64_t kAllOnes = ~std::uint64_t{0};

/// Lengths of free runs are rounded down to steps of a power of two, such that a row has between 2^kRunBits and
/// 2^(kRunBits + 1) steps. To reject rows early, kComparedRuns runs of a mask are compared with these lengths.
constexpr std::uint32_t kRunBits = 6;
constexpr std::size_t kComparedRuns = 16;
/// In rows of more than kNarrowRowWords words, the first kFullRowRuns runs of a mask are tested at all words of the
/// row. Later runs are tested only at words that still have a free position for the mask.
constexpr std::uint32_t kNarrowRowWords = 4, kFullRowRuns = 3;
/// In such wide rows, the kRecentRuns runs of the mask that blocked rows most recently are tested first, since they
/// usually block the next row, too.
constexpr std::uint32_t kRecentRuns = 4;

/// Loads two words from an unaligned address.
Word2 load_two_words(const std::uint64_t* from) {
  Word2 value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// Words per row: a power of two, so that find_place() needs few instantiations.
std::uint32_t words_per_row(std::uint32_t width) { return std::bit_ceil((width + 63) / 64); }

}  // namespace

CellRows::CellRows(std::uint32_t width, std::uint32_t height, std::uint32_t longest)
    : width_(width),
      height_(height),
      words_(words_per_row(width)),
      levels_(static_cast<std::uint32_t>(std::bit_width(std::min(width, longest)))),
      // An extra row and an extra word are allocated, since shifts read beyond the last row.
      bits_(std::size_t{levels_} * height * words_ + words_ + 1),
      step_(static_cast<std::uint32_t>(std::bit_width(width >> kRunBits)) -
            (width >> kRunBits != 0 ? 1 : 0)),
      row_words_((height + 63) / 64),
      fits_((std::size_t{width >> step_} + 1) * row_words_ + height / 64 + 2, kAllOnes),
      longest_free_(height, width >> step_),
      free_(height, FreeRun{0, width, 0}) {}

void CellRows::clear() {
  std::fill(bits_.begin(), bits_.end(), 0);
  std::fill(fits_.begin(), fits_.end(), kAllOnes);
  std::fill(longest_free_.begin(), longest_free_.end(), width_ >> step_);
  std::fill(free_.begin(), free_.end(), FreeRun{0, width_, 0});
}

void CellRows::occupy(const ChartMask& mask, std::uint32_t x, std::uint32_t y) {
  mark(mask, x, y);
  dilate(y, y + mask.height, x, x + mask.width - 1);
}

void CellRows::mark(const ChartMask& mask, std::uint32_t x, std::uint32_t y) {
  for (const ChartMask::Run& run : mask.runs) {
    std::uint64_t* const cells = row(0, y + run.row);
    for (std::uint32_t i = x + run.first, end = x + run.last + 1; i < end;) {
      const std::uint32_t count = std::min(64 - i % 64, end - i);
      cells[i / 64] |= (kAllOnes >> (64 - count)) << i % 64;
      i += count;
    }
    free_[y + run.row].occupy(x + run.first, x + run.last + 1);
  }
}

void CellRows::dilate(std::uint32_t first, std::uint32_t end, std::uint32_t left,
                      std::uint32_t right) {
  const std::uint32_t last_word = std::min(right / 64 + 1, words_);
  for (std::uint32_t k = 1; k < levels_; ++k) {
    const std::uint32_t shift = 1U << (k - 1), word_shift = shift / 64, bit_shift = shift % 64;
    const std::uint32_t first_word = (left - std::min(left, (1U << k) - 1)) / 64;
    std::uint64_t* wide_row = row(k, first);
    const std::uint64_t* narrow_row = row(k - 1, first);
    for (std::uint32_t y = first; y < end; ++y, wide_row += words_, narrow_row += words_) {
      // Bits beyond the row's end belong to the next row; they affect only places outside of the bitmap.
      const std::uint64_t* const shifted_row = narrow_row + word_shift;
      if (words_ == 1) {
        wide_row[0] =
            narrow_row[0] | shifted_row[0] >> bit_shift | shifted_row[1] << 1 << (63 - bit_shift);
        continue;
      }
      const auto signed_bit_shift = static_cast<int>(bit_shift);
      for (std::uint32_t w = first_word / 2 * 2; w < last_word; w += 2) {
        const Word2 now = load_two_words(narrow_row + w) |
                          load_two_words(shifted_row + w) >> signed_bit_shift |
                          load_two_words(shifted_row + w + 1) << 1 << (63 - signed_bit_shift);
        std::memcpy(wide_row + w, &now, sizeof now);
      }
    }
  }
  for (std::uint32_t y = first; y < end; ++y) {
    if (free_[y].length() < free_[y].max_other_length) find_longest_run(y);
    update_longest_free(y, free_[y].length() >> step_);
  }
}

void CellRows::FreeRun::occupy(std::uint32_t first, std::uint32_t last) {
  if (first >= end || last <= begin) return;
  const std::uint32_t left = first - std::min(first, begin), right = end - std::min(end, last);
  max_other_length = std::max(max_other_length, std::min(left, right));
  if (left < right) {
    begin = last;
  } else {
    end = begin + left;
  }
}

void CellRows::find_longest_run(std::uint32_t y) {
  FreeRun& longest = free_[y];
  longest = {};
  const std::uint64_t* const cells = row(0, y);
  std::uint32_t begin = 0;
  const auto add = [&](std::uint32_t end) {
    const FreeRun run{begin, end, std::max(longest.max_other_length, longest.length())};
    if (run.length() > longest.length()) {
      longest = run;
    } else {
      longest.max_other_length = std::max(longest.max_other_length, run.length());
    }
  };
  for (std::uint32_t x = 0; x < width_;) {
    const std::uint64_t word = cells[x / 64] >> x % 64;
    const std::uint32_t remaining_bits = std::min(64 - x % 64, width_ - x);
    const auto zeros = std::min(static_cast<std::uint32_t>(std::countr_zero(word)), remaining_bits);
    x += zeros;
    if (zeros == remaining_bits) continue;
    add(x);
    x += std::min(static_cast<std::uint32_t>(std::countr_one(word >> zeros)),
                  remaining_bits - zeros);
    begin = x;
  }
  if (begin < width_) add(width_);
}

void CellRows::update_longest_free(std::uint32_t y, std::uint32_t steps) {
  for (; longest_free_[y] > steps; --longest_free_[y])
    fits_[std::size_t{longest_free_[y]} * row_words_ + y / 64] &= ~(std::uint64_t{1} << y % 64);
}

/// Tests 64 rows, starting at a multiple of 64, as positions of a mask. \returns a bit for each row: 0 if the mask
/// cannot be placed there, because one of its runs is longer than every free run of the row in which the run would lie.
/// Only kComparedRuns runs are compared, from rows of the mask that are far from each other.
std::uint64_t CellRows::find_rows_with_room(const ChartMask& mask, std::uint32_t first) const {
  std::uint64_t result = kAllOnes;
  for (std::size_t n = 0; n < std::min(kComparedRuns, mask.runs.size()) && result != 0; ++n) {
    const std::uint32_t r = mask.runs[n].row;
    const std::uint64_t* const rows =
        fits_.data() +
        std::size_t{static_cast<std::uint16_t>(mask.longest[r])} / (1U << step_) * row_words_ +
        (first + r) / 64;
    result &= rows[0] >> r % 64 | rows[1] << 1 << (63 - r % 64);
  }
  return result;
}

template <std::uint32_t words>
std::optional<std::pair<std::uint32_t, std::uint32_t>> CellRows::find_place(
    const ChartMask& mask, const Window& window) const {
  const std::uint32_t places = width_ - mask.width + 1;
  std::array<std::uint64_t, words> outside_places{}, blocked_cells{};
  for (std::uint32_t w = 0; w < words; ++w) {
    const std::uint32_t from = w * 64;
    outside_places[w] = places >= from + 64 ? 0
                        : places <= from    ? kAllOnes
                                            : kAllOnes << (places - from);
  }
  const std::uint32_t top = std::min(height_, window.top);
  if (mask.height > top) return std::nullopt;
  const std::uint32_t end = top - mask.height + 1;
  std::uint32_t first_row = window.bottom / 64 * 64;
  std::uint64_t rows = 0;
  // Indices of the runs that blocked rows most recently, initially the first runs. The order of tests does not change
  // the result.
  std::array<std::uint32_t, kRecentRuns> recent_runs{0, 1, 2, 3};
  const auto runs = static_cast<std::uint32_t>(mask.runs.size());
  const std::uint32_t recent_run_count = words > kNarrowRowWords ? std::min(kRecentRuns, runs) : 0;
  for (;;) {
    while (rows == 0) {
      if (first_row >= end) return std::nullopt;
      rows = find_rows_with_room(mask, first_row);
      if (first_row < window.bottom) rows &= kAllOnes << (window.bottom - first_row);
      if (end - first_row < 64) rows &= kAllOnes >> (64 - (end - first_row));
      first_row += 64;
    }
    const std::uint32_t y = first_row - 64 + static_cast<std::uint32_t>(std::countr_zero(rows));
    rows &= rows - 1;
    blocked_cells = outside_places;
    bool is_free = true;
    std::array<std::uint32_t, words> open_words{};
    std::uint32_t count = 0;
    for (std::uint32_t r = 0; r < recent_run_count + runs && is_free; ++r) {
      const std::uint32_t run_index = r < recent_run_count ? recent_runs[r] : r - recent_run_count;
      const ChartMask::Run& run = mask.runs[run_index];
      const auto record_place = [&] {
        if (is_free || recent_run_count == 0) return;
        const std::uint32_t at = std::min(r, recent_run_count - 1);
        std::copy_backward(recent_runs.begin(), recent_runs.begin() + at,
                           recent_runs.begin() + at + 1);
        recent_runs[0] = run_index;
      };
      const std::uint32_t length = run.last - run.first + 1;
      const auto k = static_cast<std::uint32_t>(std::bit_width(length)) - 1;
      const std::uint32_t a = run.first, b = run.last + 1 - (1U << k);
      const std::uint64_t* const from = row(k, y + run.row);
      // Bits beyond the row's end affect only places that `outside_places` blocks.
      const std::uint64_t *const words_at_a = from + a / 64, *const words_at_b = from + b / 64;
      const auto blocked_word = [&](std::uint32_t w) {
        return blocked_cells[w] |=
               words_at_a[w] >> a % 64 | words_at_a[w + 1] << 1 << (63 - a % 64) |
               words_at_b[w] >> b % 64 | words_at_b[w + 1] << 1 << (63 - b % 64);
      };
      if (words > kNarrowRowWords && r > kFullRowRuns) {
        // In wide rows, only words with a free place are tested.
        std::uint32_t open_word_count = 0;
        for (std::uint32_t n = 0; n < count; ++n) {
          const std::uint32_t w = open_words[n];
          open_words[open_word_count] = w;
          open_word_count += blocked_word(w) != kAllOnes ? 1 : 0;
        }
        count = open_word_count;
        is_free = count > 0;
        record_place();
        continue;
      }
      if constexpr (words == 1) {
        is_free = blocked_word(0) != kAllOnes;
      } else {
        const auto down_a = static_cast<int>(a % 64), down_b = static_cast<int>(b % 64);
        Word2 all{kAllOnes, kAllOnes};
        for (std::uint32_t w = 0; w < words; w += 2) {
          const Word2 now = load_two_words(blocked_cells.data() + w) |
                            load_two_words(words_at_a + w) >> down_a |
                            load_two_words(words_at_a + w + 1) << 1 << (63 - down_a) |
                            load_two_words(words_at_b + w) >> down_b |
                            load_two_words(words_at_b + w + 1) << 1 << (63 - down_b);
          std::memcpy(blocked_cells.data() + w, &now, sizeof now);
          all &= now;
        }
        is_free = (all[0] & all[1]) != kAllOnes;
      }
      record_place();
      if (words <= kNarrowRowWords || r < kFullRowRuns) continue;
      for (std::uint32_t w = 0; w < words; ++w) {
        open_words[count] = w;
        count += blocked_cells[w] != kAllOnes ? 1 : 0;
      }
    }
    if (!is_free) continue;
    for (std::uint32_t w = 0; w < words; ++w) {
      if (blocked_cells[w] == kAllOnes) continue;
      return std::pair{w * 64 + static_cast<std::uint32_t>(std::countr_one(blocked_cells[w])), y};
    }
  }
}

std::optional<std::pair<std::uint32_t, std::uint32_t>> CellRows::find(const ChartMask& mask,
                                                                      const Window& window) const {
  if (mask.width > width_ || mask.height > height_) return std::nullopt;
  switch (words_) {
    case 1:
      return find_place<1>(mask, window);
    case 2:
      return find_place<2>(mask, window);
    case 4:
      return find_place<4>(mask, window);
    case 8:
      return find_place<8>(mask, window);
    case 16:
      return find_place<16>(mask, window);
    default:
      return find_place<32>(mask, window);
  }
}

}  // namespace kiln
