#include "pack/atlas_bitmap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "base/progress_guard.h"
#include "pack/cell_rows.h"

namespace kiln {
namespace {

/// How many of the largest outlines are rasterised at all rotations, and how many at half of these.
constexpr std::size_t kMaxOutlinesAtAllTurns = 12, kMaxOutlinesAtHalfTurns = 32;

/// If there are more outlines than this, the search for a place starts at the row at which the last outline of
/// similar size was placed.
constexpr std::size_t kLowestRowsOutlines = 100;
/// Factor within which sizes count as similar.
constexpr double kSimilarSizeRatio = 1.25;

/// Lowest rows at which outlines of each size may still fit.
class LowestRowsBySize {
 public:
  explicit LowestRowsBySize(std::size_t count) : uses_rows_(count > kLowestRowsOutlines) {}

  /// The row at which the search for an outline starts.
  /// \param mask  the outline's mask at any rotation
  std::uint32_t& of(const Outline& outline, const ChartMask& mask) {
    if (!uses_rows_) return row_0_ = 0;  // With few outlines, every search starts at row 0
    const auto step = [](double size) {
      return static_cast<int>(std::log(size) / std::log(kSimilarSizeRatio));
    };
    return rows_[{step(outline.area), step(std::max(mask.width, mask.height))}];
  }

 private:
  bool uses_rows_;
  std::uint32_t row_0_ = 0;
  std::map<std::pair<int, int>, std::uint32_t> rows_;
};

/// Finds the place where an outline's top is lowest, over all its allowed rotations.
/// \param guess  index of the rotation that is probably the best, or -1. It is tried first, since a good place
///               shortens the search; it never changes the result
/// \param bottom  first row of the search
void find_lowest_place(const CellRows& occupied, const AtlasBitmap& sheet, const PackOrder& order,
                       std::uint32_t i, std::int8_t guess, std::uint32_t bottom, Packed& packed) {
  CellRows::Window window{sheet.cells, bottom};
  const auto try_turn = [&](std::int8_t turn) {
    const ChartMask& mask = sheet.mask(i, turn);
    if (mask.runs.empty()) return;
    const auto at = occupied.find(mask, window);
    if (!at) return;
    const std::uint32_t top = at->second + mask.height;
    if (packed.turn[i] >= 0 &&
        std::tie(top, at->first, turn) >= std::tie(window.top, packed.x[i], packed.turn[i])) {
      return;
    }
    window.top = top;  // The tops of later rotations must not be higher
    packed.x[i] = at->first, packed.y[i] = at->second;
    packed.turn[i] = turn;
  };
  if (order.turn[i] >= 0) return try_turn(order.turn[i]);
  if (guess >= 0) try_turn(guess);
  for (std::int8_t turn = 0; turn < static_cast<std::int8_t>(AtlasPacker::kTurns); ++turn) {
    if (turn != guess) try_turn(turn);
  }
}

}  // namespace

AtlasPacker::AtlasPacker(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         std::vector<double> angles)
    : outlines_(outlines), size_(size), padding_(padding), angles_(std::move(angles)) {
  const bool new_angles = angles_.empty();
  for (const Outline& outline : outlines) {
    area_ += outline.area;
    if (new_angles) angles_.push_back(best_box_angle(outline));
  }
  std::vector<std::uint32_t> order(outlines.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return outlines[a].area > outlines[b].area;
  });
  rotations_of_.resize(outlines.size());
  for (std::size_t n = 0; n < order.size(); ++n) {
    rotations_of_[order[n]] = n < kMaxOutlinesAtAllTurns    ? kTurns
                              : n < kMaxOutlinesAtHalfTurns ? kTurns / 2
                                                            : kTurns / 4;
  }
}

AtlasBitmap AtlasPacker::draw(std::uint32_t cells, double scale) const {
  AtlasBitmap sheet{cells, scale, std::vector<ChartMask>(outlines_.size() * kTurns)};
  const double margin = 0.5 * padding_ * cells / size_;
  for (std::size_t i = 0; i < outlines_.size(); ++i) {
    const auto angle = [&](std::uint32_t turn) {
      return angles_[i] + turn * 2 * std::numbers::pi / kTurns;
    };
    ChartMask* const masks = sheet.masks.data() + i * kTurns;
    for (std::uint32_t turn = 0; turn < kTurns / 4; turn += kTurns / rotations_of_[i]) {
      auto turned = make_turned_masks(outlines_[i], angle(turn), scale, margin);
      for (std::uint32_t quarter = 0; quarter < 4; ++quarter) {
        masks[turn + quarter * kTurns / 4] = std::move(turned[quarter]);
      }
    }
  }
  return sheet;
}

/// Records the place of an outline whose x, y and rotation are set. A negative rotation records it as left out.
void AtlasPacker::record_place(const AtlasBitmap& sheet, std::uint32_t outline,
                               Packed& packed) const {
  if (packed.turn[outline] < 0) {
    packed.left_out += outlines_[outline].area;
    packed.refused.push_back(outline);
    return;
  }
  const ChartMask& mask = sheet.mask(outline, packed.turn[outline]);
  const std::uint32_t x = packed.x[outline], y = packed.y[outline];
  const double cell = static_cast<double>(size_) / sheet.cells;
  packed.places[outline] = {mask.turn, {(x + mask.shift.x) * cell, (y + mask.shift.y) * cell}};
  packed.weight += outlines_[outline].area * (y + mask.height);
  packed.height = std::max(packed.height, y + mask.height);
}

Packed AtlasPacker::pack(const AtlasBitmap& sheet, const PackOrder& order, double most,
                         const Packed* done, std::size_t same) const {
  Packed packed;
  packed.places.assign(outlines_.size(), {});
  packed.turn.assign(outlines_.size(), -1);
  packed.x.assign(outlines_.size(), 0), packed.y = packed.x;
  std::uint32_t longest = 1;
  for (const ChartMask& mask : sheet.masks) {
    if (!mask.runs.empty())  // The longest run comes first.
      longest = std::max(longest, mask.runs[0].last - mask.runs[0].first + 1);
  }
  CellRows occupied(sheet.cells, sheet.cells, longest);
  LowestRowsBySize lowest(outlines_.size());
  for (std::size_t n = 0; n < order.order.size(); ++n) {
    ProgressGuard::poll();
    const std::uint32_t i = order.order[n];
    std::uint32_t& bottom = lowest.of(outlines_[i], sheet.masks[std::size_t{i} * kTurns]);
    if (n < same) {
      packed.turn[i] = done->turn[i], packed.x[i] = done->x[i], packed.y[i] = done->y[i];
    } else {
      if (n == same && n > 0) occupied.dilate(0, sheet.cells, 0, sheet.cells - 1);
      find_lowest_place(occupied, sheet, order, i,
                        done != nullptr ? done->turn[i] : std::int8_t{-1}, bottom, packed);
    }
    record_place(sheet, i, packed);
    if (packed.left_out > most) return packed;
    if (packed.turn[i] < 0) continue;
    const ChartMask& mask = sheet.mask(i, packed.turn[i]);
    if (n < same) {
      occupied.mark(mask, packed.x[i], packed.y[i]);
    } else {
      occupied.occupy(mask, packed.x[i], packed.y[i]);
      // Outlines of another shape may fit slightly lower, so the row is lowered by the mask's height.
      bottom = std::max(bottom, packed.y[i] - std::min(packed.y[i], mask.height));
    }
  }
  return packed;
}

}  // namespace kiln
