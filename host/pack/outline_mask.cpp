#include "pack/outline_mask.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/vectors.h"
#include "mesh/box.h"
namespace kiln {
namespace {

Vec2d rotate(const Vec2d& p, const Vec2d& turn) {
  return {turn.x * p.x - turn.y * p.y, turn.y * p.x + turn.x * p.y};
}

/// The extent of a shape in x within a slab; a slab is a row of cells between two heights.
struct Span {
  double min_x = std::numeric_limits<double>::max(), max_x = -min_x;
  void add(double x) {
    min_x = std::min(min_x, x);
    max_x = std::max(max_x, x);
  }
};

Double2 in_both_lanes(double value) { return Double2{value, value}; }

/// The two long sides of the strip around a segment, each from its lower to its upper end.
struct EdgeStrip {
  Double2 low_x, low_y, high_x, high_y, slope;

  EdgeStrip(const Vec2d& a, const Vec2d& b, const Vec2d& side) {
    const Double2 offset_x{side.x, -side.x}, offset_y{side.y, -side.y};
    const Double2 ax = in_both_lanes(a.x) + offset_x, ay = in_both_lanes(a.y) + offset_y;
    const Double2 bx = in_both_lanes(b.x) + offset_x, by = in_both_lanes(b.y) + offset_y;
    const auto is_rising = ay <= by;
    low_x = select(is_rising, ax, bx), low_y = select(is_rising, ay, by);
    high_x = select(is_rising, bx, ax), high_y = select(is_rising, by, ay);
    slope = select(ay == by, in_both_lanes(0), (bx - ax) / (by - ay));
  }

  /// Extends a span by the strip's extent within the slab.
  void extend(Span& span, double bottom) const {
    const Double2 from = in_both_lanes(bottom), to = in_both_lanes(bottom + 1);
    const Double2 begin = select(low_y < from, low_x + (from - low_y) * slope, low_x);
    const Double2 end = select(high_y > to, high_x + (to - high_y) * slope, high_x);
    const Double2 none = in_both_lanes(std::numeric_limits<double>::max());
    const auto is_outside = (high_y < from) | (low_y > to);
    const Double2 low = select(is_outside, none, select(begin < end, begin, end));
    const Double2 high = select(is_outside, -none, select(begin < end, end, begin));
    span.min_x = std::min({span.min_x, low[0], low[1]});
    span.max_x = std::max({span.max_x, high[0], high[1]});
  }
};

/// Extends a span by a disc's extent within the slab.
inline void add_disc(const Vec2d& centre, double radius, double bottom, Span& span) {
  const double vertical_distance = centre.y - std::clamp(centre.y, bottom, bottom + 1);
  const double squared_reach = radius * radius - vertical_distance * vertical_distance;
  if (squared_reach < 0) return;
  const double reach = std::sqrt(squared_reach);
  span.add(centre.x - reach);
  span.add(centre.x + reach);
}

/// A bitmap of cells, in rows of 64-bit words.
class CellBitmap {
 public:
  CellBitmap(std::uint32_t width, std::uint32_t height)
      : width_(width), height_(height), words_(width / 64 + 1), occupied_(words_ * height, 0) {}

  /// Sets every cell whose distance from the ring is at most `margin`.
  void set_within_margin(const std::vector<Vec2d>& ring, double margin) {
    if (ring.empty()) return;
    Disc first, a, b;
    find(first, ring[0], margin);
    a = first;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const bool is_last = i + 1 == ring.size();
      if (!is_last) find(b, ring[i + 1], margin);
      set_within_margin(ring[i], ring[is_last ? 0 : i + 1], margin, a, is_last ? first : b);
      std::swap(a, b);
    }
  }

  /// Sets cells whose centres are inside of the rings. Each edge toggles all cells to its right (even-odd rule).
  void fill(const std::vector<std::vector<Vec2d>>& rings) {
    for (const auto& ring : rings) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        Vec2d a = ring[i], b = ring[(i + 1) % ring.size()];
        if (a.y > b.y) std::swap(a, b);
        const double slope = (b.x - a.x) / (b.y - a.y);
        for (std::uint32_t y = round_up(a.y - 0.5, height_), end = round_up(b.y - 0.5, height_);
             y < end; ++y) {
          const std::uint32_t cell = round_up(a.x + (y + 0.5 - a.y) * slope - 0.5, width_);
          row(y)[cell / 64] ^= std::uint64_t{1} << cell % 64;
        }
      }
    }
    for (std::uint32_t y = 0; y < height_; ++y) {
      std::uint64_t carry_bits = 0;
      for (std::size_t w = 0; w < words_; ++w) {
        std::uint64_t& word = row(y)[w];
        for (std::uint32_t shift = 1; shift < 64; shift *= 2) word ^= word << shift;
        word ^= carry_bits;
        carry_bits = (word >> 63) != 0 ? ~std::uint64_t{0} : 0;
      }
    }
  }

  /// The bitmap rotated by 90 degrees: rows become columns, the lowest row becomes the last column.
  CellBitmap turned() const {
    CellBitmap result(height_, width_);
    std::array<std::uint64_t, 64> block;
    for (std::size_t w = 0; w < words_; ++w) {
      for (std::uint32_t base = 0; base < height_; base += 64) {
        const std::uint32_t rows = std::min(64U, height_ - base);
        // In each new row of the block, bit i comes from the old row `top` - 1 - i.
        const std::uint32_t top = height_ - base;
        for (std::uint32_t i = 0; i < 64; ++i) block[i] = i < rows ? row(top - 1 - i)[w] : 0;
        transpose(block);
        const auto columns = static_cast<std::uint32_t>(std::min<std::size_t>(64, width_ - 64 * w));
        for (std::uint32_t i = 0; i < columns; ++i) {
          result.row(static_cast<std::uint32_t>(64 * w) + i)[base / 64] = block[i];
        }
      }
    }
    return result;
  }

  /// All runs of set cells, row by row.
  std::vector<ChartMask::Run> runs() const {
    std::vector<ChartMask::Run> result;
    result.reserve(height_ + height_ / 2);
    for (std::uint32_t y = 0; y < height_; ++y) {
      for (std::uint32_t x = next_cell(y, 0, true); x < width_;) {
        const std::uint32_t end = next_cell(y, x, false);
        result.push_back({y, x, end - 1});
        x = next_cell(y, end, true);
      }
    }
    return result;
  }

 private:
  /// Extents of the disc around a vertex in the rows that it intersects.
  struct Disc {
    std::uint32_t first = 0;
    std::vector<Span> rows;

    void extend(Span& span, std::uint32_t y) const {
      // For rows below `first`, the unsigned difference wraps to a large number
      if (y - first >= rows.size()) return;
      span.min_x = std::min(span.min_x, rows[y - first].min_x);
      span.max_x = std::max(span.max_x, rows[y - first].max_x);
    }
  };

  void find(Disc& disc, const Vec2d& centre, double radius) const {
    disc.first = row_at(centre.y - radius - kRoundingMargin);
    const std::uint32_t last = row_at(centre.y + radius + kRoundingMargin);
    disc.rows.assign(last - disc.first + 1, {});
    for (std::uint32_t y = disc.first; y <= last; ++y)
      add_disc(centre, radius, y, disc.rows[y - disc.first]);
  }

  /// Sets the cells whose distance from one edge is at most `margin`: in each row, the extent of the discs around
  /// its two vertices and of the strip between them.
  void set_within_margin(const Vec2d& a, const Vec2d& b, double margin, const Disc& at_a,
                         const Disc& at_b) {
    const Vec2d edge_direction = b - a;
    const double size = std::sqrt(dot(edge_direction, edge_direction));
    const EdgeStrip strip(
        a, b,
        size > 0 ? Vec2d{-edge_direction.y, edge_direction.x} * (margin / size) : Vec2d{0, 0});
    const std::uint32_t first = row_at(std::min(a.y, b.y) - margin - kRoundingMargin);
    const std::uint32_t last = row_at(std::max(a.y, b.y) + margin + kRoundingMargin);
    for (std::uint32_t y = first; y <= last; ++y) {
      Span span;
      at_a.extend(span, y);
      at_b.extend(span, y);
      strip.extend(span, y);
      if (span.min_x <= span.max_x)
        set_cells(y, span.min_x - kRoundingMargin, span.max_x + kRoundingMargin);
    }
  }

  /// Tolerance that exceeds all rounding errors, in cells.
  static constexpr double kRoundingMargin = 1e-9;

  /// Transposes a 64 x 64 bit matrix by recursive swaps of off-diagonal blocks (Warren, "Hacker's Delight", section
  /// 7-3).
  static void transpose(std::array<std::uint64_t, 64>& block) {
    std::uint64_t low = 0xffffffff;
    for (std::uint32_t half = 32; half != 0; half /= 2, low ^= low << half) {
      for (std::uint32_t i = 0; i < 64; i = (i + half + 1) & ~half) {
        const std::uint64_t swap = (block[i] >> half ^ block[i + half]) & low;
        block[i + half] ^= swap;
        block[i] ^= swap << half;
      }
    }
  }

  std::uint64_t* row(std::uint32_t y) { return occupied_.data() + words_ * y; }
  const std::uint64_t* row(std::uint32_t y) const { return occupied_.data() + words_ * y; }
  /// Rounds up, clamped to [0, max].
  static std::uint32_t round_up(double value, std::uint32_t most) {
    const double clamped_value = std::clamp(value, 0.0, 1.0 * most);
    const auto integer_part = static_cast<std::int32_t>(clamped_value);
    return static_cast<std::uint32_t>(integer_part + (integer_part < clamped_value ? 1 : 0));
  }
  /// Index of the cell at a coordinate, clamped to [0, count).
  static std::uint32_t cell_at(double place, std::uint32_t count) {
    return static_cast<std::uint32_t>(
        static_cast<std::int32_t>(std::clamp(place, 0.0, count - 1.0)));
  }
  std::uint32_t row_at(double y) const { return cell_at(y, height_); }

  void set_cells(std::uint32_t y, double low, double high) {
    for (std::uint32_t x = cell_at(low, width_), end = cell_at(high, width_) + 1; x < end;) {
      const std::uint32_t count = std::min(64 - x % 64, end - x);
      row(y)[x / 64] |= (~std::uint64_t{0} >> (64 - count)) << x % 64;
      x += count;
    }
  }

  /// The first cell at or after x whose state is `is_set`; the width if there is none.
  std::uint32_t next_cell(std::uint32_t y, std::uint32_t x, bool is_set) const {
    while (x < width_) {
      const std::uint64_t word = row(y)[x / 64];
      const std::uint64_t rest = (is_set ? word : ~word) >> x % 64;
      if (rest != 0)
        return std::min(width_, x + static_cast<std::uint32_t>(std::countr_zero(rest)));
      x = (x / 64 + 1) * 64;
    }
    return width_;
  }

  std::uint32_t width_, height_;
  std::size_t words_;
  std::vector<std::uint64_t> occupied_;
};

/// A mask whose runs are not set yet, and the bitmap from which they are computed.
struct MaskBitmap {
  ChartMask mask;
  CellBitmap cells;
};

MaskBitmap draw(const Outline& outline, double angle, double scale, double margin) {
  ChartMask mask;
  mask.turn = {std::cos(angle), std::sin(angle)};
  std::vector<std::vector<Vec2d>> rings = outline.rings;
  Box<Vec2d> box;
  for (auto& ring : rings) {
    for (Vec2d& p : ring) {
      p = rotate(p, mask.turn) * scale;
      box.add(p);
    }
  }
  mask.shift = {margin - box.low.x, margin - box.low.y};
  const auto cells = [&](double extent) {
    return static_cast<std::uint32_t>(std::max(1.0, std::ceil(extent + 2 * margin)));
  };
  mask.width = cells(box.high.x - box.low.x);
  mask.height = cells(box.high.y - box.low.y);
  for (auto& ring : rings) {
    for (Vec2d& p : ring) p = p + mask.shift;
  }
  CellBitmap grid(mask.width, mask.height);
  grid.fill(rings);
  for (const auto& ring : rings) grid.set_within_margin(ring, margin);
  return {std::move(mask), std::move(grid)};
}

}  // namespace

void ChartMask::sort_runs() {
  longest.assign(height, 0);
  const Run* longest_run = nullptr;
  for (const Run& run : runs) {
    const auto count = static_cast<std::int16_t>(run.last - run.first + 1);
    longest[run.row] = std::max(longest[run.row], count);
    if (longest_run == nullptr || run.last - run.first > longest_run->last - longest_run->first)
      longest_run = &run;
  }
  if (longest_run == nullptr) return;
  // Neighbouring rows are similar, so a row that blocks the mask is found sooner if rows far from each other are tested
  // first. Rows are sorted by the power of 2 that divides their index, up to this exponent.
  static constexpr std::uint32_t kMaxRowExponent = 4;
  const auto place = [](const Run& run) {
    return kMaxRowExponent -
           std::min(kMaxRowExponent, static_cast<std::uint32_t>(std::countr_zero(run.row)));
  };
  std::array<std::size_t, kMaxRowExponent + 2> starts{};
  for (const Run& run : runs) ++starts[place(run) + 1];
  for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
  std::vector<Run> arranged_runs(runs.size());
  // The longest run is moved to the front, so the starts of all groups before the run's own group move by one.
  for (std::uint32_t i = 0; i <= place(*longest_run); ++i) starts[i] += 1;
  arranged_runs[0] = *longest_run;
  for (const Run& run : runs) {
    if (&run != longest_run) arranged_runs[starts[place(run)]++] = run;
  }
  runs = std::move(arranged_runs);
}

std::array<ChartMask, 4> make_turned_masks(const Outline& outline, double angle, double scale,
                                           double margin) {
  MaskBitmap mask_bitmap = draw(outline, angle, scale, margin);
  std::array<ChartMask, 4> masks;
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    ChartMask& mask = masks[quarter];
    if (quarter == 0) {
      mask = std::move(mask_bitmap.mask);
    } else {
      const ChartMask& last = masks[quarter - 1];
      mask.width = last.height;
      mask.height = last.width;
      mask.turn = {-last.turn.y, last.turn.x};
      mask.shift = {last.height - last.shift.y, last.shift.x};
    }
    if (quarter < 2) {
      if (quarter == 1) mask_bitmap.cells = mask_bitmap.cells.turned();
      mask.runs = mask_bitmap.cells.runs();
    } else {
      mask.runs.reserve(masks[quarter - 2].runs.size());
      for (const ChartMask::Run& run : masks[quarter - 2].runs) {
        mask.runs.push_back(
            {mask.height - 1 - run.row, mask.width - 1 - run.last, mask.width - 1 - run.first});
      }
    }
    mask.sort_runs();
  }
  return masks;
}

double best_box_angle(const Outline& outline) {
  double best = 0, min_area = std::numeric_limits<double>::max();
  constexpr int kAngleSteps = 48;
  for (int i = 0; i < kAngleSteps; ++i) {
    const double angle = i * (0.5 * std::numbers::pi / kAngleSteps);
    const Vec2d turn{std::cos(angle), std::sin(angle)};
    Box<Vec2d> box;
    for (const auto& ring : outline.rings) {
      for (const Vec2d& p : ring) box.add(rotate(p, turn));
    }
    const double area = (box.high.x - box.low.x) * (box.high.y - box.low.y);
    if (area < min_area * (1 - 1e-9)) min_area = area, best = angle;
  }
  return best;
}

}  // namespace kiln
