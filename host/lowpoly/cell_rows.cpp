#include "lowpoly/cell_rows.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <span>

namespace kiln {
namespace {

constexpr std::uint64_t kAllOnes = ~std::uint64_t{0};

/// Of rows of more words, only those with room are looked at after some runs.
constexpr std::uint32_t kFewWords = 4, kWholeRuns = 3;

/// Two words in a register: the compilers' vector extension.
using TwoWords = std::uint64_t __attribute__((vector_size(16)));

TwoWords load_two(const std::uint64_t* from) {
  TwoWords value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// Words a row: a power of two, so that there are few kinds.
std::uint32_t words_of(std::uint32_t width) { return std::bit_ceil((width + 63) / 64); }

/// Whether any of some rows needs more than there is. Four numbers a word: none borrows from the next, since all
/// are below 2^15.
template <std::size_t count>
bool is_tight(const std::int16_t* need, const std::int16_t* room) {
  constexpr std::uint64_t kTop = 0x8000800080008000;
  std::uint64_t fits = kTop;
  for (std::size_t i = 0; i < count; i += 4) {
    std::uint64_t n, r;
    std::memcpy(&n, need + i, sizeof n);
    std::memcpy(&r, room + i, sizeof r);
    fits &= (r | kTop) - n;
  }
  return fits != kTop;
}

/// The highest row that needs more than there is; the number of rows, where none does.
std::uint32_t tight_row(std::span<const std::int16_t> needed, const std::int16_t* room) {
  constexpr std::size_t kBlock = 32, kSmall = 8;
  std::size_t row = needed.size();
  while (row >= kBlock && !is_tight<kBlock>(needed.data() + row - kBlock, room + row - kBlock))
    row -= kBlock;
  while (row >= kSmall && !is_tight<kSmall>(needed.data() + row - kSmall, room + row - kSmall))
    row -= kSmall;
  while (row > 0 && needed[row - 1] <= room[row - 1]) --row;
  return static_cast<std::uint32_t>(row > 0 ? row - 1 : needed.size());
}

std::uint32_t longest_free(const std::uint64_t* row, std::uint32_t width) {
  std::uint32_t longest = 0, run = 0;
  for (std::uint32_t x = 0; x < width;) {
    const std::uint64_t word = row[x / 64] >> x % 64;
    const std::uint32_t left = std::min(64 - x % 64, width - x);
    const auto zeros = std::min(static_cast<std::uint32_t>(std::countr_zero(word)), left);
    run += zeros;
    longest = std::max(longest, run);
    x += zeros;
    if (zeros == left) continue;
    x += std::min(static_cast<std::uint32_t>(std::countr_one(word >> zeros)), left - zeros);
    run = 0;
  }
  return longest;
}

}  // namespace

CellRows::CellRows(std::uint32_t width, std::uint32_t height, std::uint32_t longest)
    : width_(width),
      height_(height),
      words_(words_of(width)),
      levels_(static_cast<std::uint32_t>(std::bit_width(std::min(width, longest)))),
      // Shifting reads beyond the last row.
      bits_(std::size_t{levels_} * height * words_ + words_ + 1),
      longest_(height, static_cast<std::int16_t>(width)) {}

void CellRows::clear() {
  std::fill(bits_.begin(), bits_.end(), 0);
  std::fill(longest_.begin(), longest_.end(), static_cast<std::int16_t>(width_));
}

void CellRows::take(const ChartMask& mask, std::uint32_t x, std::uint32_t y) {
  mark(mask, x, y);
  widen(y, y + mask.height, x, x + mask.width - 1);
}

void CellRows::mark(const ChartMask& mask, std::uint32_t x, std::uint32_t y) {
  for (const ChartMask::Run& run : mask.runs) {
    std::uint64_t* const cells = row(0, y + run.row);
    for (std::uint32_t i = x + run.first, end = x + run.last + 1; i < end;) {
      const std::uint32_t count = std::min(64 - i % 64, end - i);
      cells[i / 64] |= (kAllOnes >> (64 - count)) << i % 64;
      i += count;
    }
  }
}

void CellRows::widen(std::uint32_t first, std::uint32_t end, std::uint32_t left,
                     std::uint32_t right) {
  const std::uint32_t last_word = std::min(right / 64 + 1, words_);
  for (std::uint32_t k = 1; k < levels_; ++k) {
    const std::uint32_t shift = 1U << (k - 1), whole = shift / 64, part = shift % 64;
    const std::uint32_t first_word = (left - std::min(left, (1U << k) - 1)) / 64;
    for (std::uint32_t at = first; at < end; ++at) {
      std::uint64_t* const wide = row(k, at);
      const std::uint64_t* const narrow = row(k - 1, at);
      // What comes from beyond the row's end is of places outside.
      const std::uint64_t* const beside = narrow + whole;
      for (std::uint32_t w = first_word; w < last_word; ++w) {
        wide[w] = narrow[w] | beside[w] >> part | beside[w + 1] << 1 << (63 - part);
      }
    }
  }
  for (std::uint32_t at = first; at < end; ++at) {
    longest_[at] = static_cast<std::int16_t>(longest_free(row(0, at), width_));
  }
}

/// The first row from y on where each of the mask's rows has as many free cells in a row as its longest run.
std::uint32_t CellRows::first_with_room(const ChartMask& mask, std::uint32_t y,
                                        std::uint32_t end) const {
  while (y < end) {
    // The highest row with too little room: nor may any of the mask's rows below that needs more lie on it.
    std::uint32_t row = tight_row(mask.longest, longest_.data() + y);
    if (row == mask.height) break;
    const std::int16_t room = longest_[y + row];
    const std::uint32_t at = y + row;
    while (row > 0 && mask.longest[row - 1] > room) --row;
    y = at + 1 - row;
  }
  return y;
}

template <std::uint32_t words>
std::optional<std::pair<std::uint32_t, std::uint32_t>> CellRows::find_in(
    const ChartMask& mask, const Window& window) const {
  const std::uint32_t places = std::min(width_ - mask.width, window.last) + 1;
  std::array<std::uint64_t, words> outside{}, blocked{};
  for (std::uint32_t w = 0; w < words; ++w) {
    const std::uint32_t from = w * 64;
    outside[w] = places >= from + 64 ? 0 : places <= from ? kAllOnes : kAllOnes << (places - from);
    if (window.first >= from + 64) {
      outside[w] = kAllOnes;
    } else if (window.first > from) {
      outside[w] |= kAllOnes >> (from + 64 - window.first);
    }
  }
  const std::uint32_t top = std::min(height_, window.top);
  if (mask.height > top) return std::nullopt;
  const std::uint32_t end = top - mask.height + 1;
  for (std::uint32_t y = first_with_room(mask, window.bottom, end); y < end;
       y = first_with_room(mask, y + 1, end)) {
    blocked = outside;
    bool free = true;
    std::array<std::uint32_t, words> open{};
    std::uint32_t count = 0;
    for (std::size_t r = 0; r < mask.runs.size() && free; ++r) {
      const ChartMask::Run& run = mask.runs[r];
      const std::uint32_t length = run.last - run.first + 1;
      const auto k = static_cast<std::uint32_t>(std::bit_width(length)) - 1;
      const std::uint32_t a = run.first, b = run.last + 1 - (1U << k);
      const std::uint64_t* const from = row(k, y + run.row);
      // What comes from beyond the row's end is outside anyway.
      const std::uint64_t *const at_a = from + a / 64, *const at_b = from + b / 64;
      const auto block = [&](std::uint32_t w) {
        return blocked[w] |= at_a[w] >> a % 64 | at_a[w + 1] << 1 << (63 - a % 64) |
                             at_b[w] >> b % 64 | at_b[w + 1] << 1 << (63 - b % 64);
      };
      if (words > kFewWords && r > kWholeRuns) {
        // Of wide rows, only the words that still have a place.
        std::uint32_t left = 0;
        for (std::uint32_t n = 0; n < count; ++n) {
          const std::uint32_t w = open[n];
          open[left] = w;
          left += block(w) != kAllOnes ? 1 : 0;
        }
        count = left;
        free = count > 0;
        continue;
      }
      if constexpr (words == 1) {
        free = block(0) != kAllOnes;
      } else {
        const auto down_a = static_cast<int>(a % 64), down_b = static_cast<int>(b % 64);
        TwoWords all{kAllOnes, kAllOnes};
        for (std::uint32_t w = 0; w < words; w += 2) {
          const TwoWords now = load_two(blocked.data() + w) | load_two(at_a + w) >> down_a |
                               load_two(at_a + w + 1) << 1 << (63 - down_a) |
                               load_two(at_b + w) >> down_b |
                               load_two(at_b + w + 1) << 1 << (63 - down_b);
          std::memcpy(blocked.data() + w, &now, sizeof now);
          all &= now;
        }
        free = (all[0] & all[1]) != kAllOnes;
      }
      if (words <= kFewWords || r < kWholeRuns) continue;
      for (std::uint32_t w = 0; w < words; ++w) {
        open[count] = w;
        count += blocked[w] != kAllOnes ? 1 : 0;
      }
    }
    if (!free) continue;
    for (std::uint32_t w = 0; w < words; ++w) {
      if (blocked[w] == kAllOnes) continue;
      return std::pair{w * 64 + static_cast<std::uint32_t>(std::countr_one(blocked[w])), y};
    }
  }
  return std::nullopt;
}

std::optional<std::pair<std::uint32_t, std::uint32_t>> CellRows::find(const ChartMask& mask,
                                                                      const Window& window) const {
  if (mask.width > width_ || mask.height > height_) return std::nullopt;
  switch (words_) {
    case 1:
      return find_in<1>(mask, window);
    case 2:
      return find_in<2>(mask, window);
    case 4:
      return find_in<4>(mask, window);
    case 8:
      return find_in<8>(mask, window);
    case 16:
      return find_in<16>(mask, window);
    default:
      return find_in<32>(mask, window);
  }
}

}  // namespace kiln
