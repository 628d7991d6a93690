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

/// The kMaxOutlinesAtAllRotations largest outlines are rasterised at all rotations, and the kMaxOutlinesAtHalfRotations
/// largest ones at half of the rotations at least.
constexpr std::size_t kMaxOutlinesAtAllRotations = 12, kMaxOutlinesAtHalfRotations = 32;

/// If there are more outlines than this, the search for a place starts at the row at which the last outline of
/// similar size was placed.
constexpr std::size_t kLowestRowsOutlines = 100;
/// Sizes count as similar if their ratio is at most this.
constexpr double kSimilarSizeRatio = 1.25;

/// For each class of similar sizes, the lowest row at which outlines may still fit.
class LowestRowsBySize {
 public:
  explicit LowestRowsBySize(std::size_t count) : uses_lowest_rows_(count > kLowestRowsOutlines) {}

  /// The row at which the search for an outline starts.
  /// \param mask  the outline's mask at any rotation
  std::uint32_t& of(const Outline& outline, const ChartMask& mask) {
    // If there are few outlines, every search for a place starts at the first row
    if (!uses_lowest_rows_) return first_row_ = 0;
    const auto step = [](double size) {
      return static_cast<int>(std::log(size) / std::log(kSimilarSizeRatio));
    };
    return lowest_rows_[{step(outline.area), step(std::max(mask.width, mask.height))}];
  }

 private:
  bool uses_lowest_rows_;
  std::uint32_t first_row_ = 0;
  std::map<std::pair<int, int>, std::uint32_t> lowest_rows_;
};

/// Finds the place where an outline's top is lowest, over all its allowed rotations.
/// \param guess index of the rotation that is probably the best, or -1. It is tried first, since an early good position
///               shortens the search; it does not change the result
/// \param bottom  first row of the search
void find_lowest_place(const CellRows& occupied_cells, const AtlasBitmap& sheet,
                       const PackOrder& order, std::uint32_t i, std::int8_t guess,
                       std::uint32_t bottom, PackedOutlines& packed) {
  CellRows::Window window{sheet.cells, bottom};
  const auto try_turn = [&](std::int8_t turn) {
    const ChartMask& mask = sheet.mask(i, turn);
    if (mask.runs.empty()) return;
    const auto at = occupied_cells.find(mask, window);
    if (!at) return;
    const std::uint32_t top = at->second + mask.height;
    if (packed.turn[i] >= 0 &&
        std::tie(top, at->first, turn) >= std::tie(window.top, packed.x[i], packed.turn[i])) {
      return;
    }
    window.top = top;  // Later rotations only count if the outline's top is not higher than here
    packed.x[i] = at->first, packed.y[i] = at->second;
    packed.turn[i] = turn;
  };
  if (order.turn[i] >= 0) return try_turn(order.turn[i]);
  if (guess >= 0) try_turn(guess);
  for (std::int8_t turn = 0; turn < static_cast<std::int8_t>(AtlasPacker::kRotations); ++turn) {
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
  rotation_counts_.resize(outlines.size());
  for (std::size_t n = 0; n < order.size(); ++n) {
    rotation_counts_[order[n]] = n < kMaxOutlinesAtAllRotations    ? kRotations
                                 : n < kMaxOutlinesAtHalfRotations ? kRotations / 2
                                                                   : kRotations / 4;
  }
}

AtlasBitmap AtlasPacker::draw(std::uint32_t cells, double scale) const {
  AtlasBitmap sheet{cells, scale, std::vector<ChartMask>(outlines_.size() * kRotations)};
  const double margin = 0.5 * padding_ * cells / size_;
  for (std::size_t i = 0; i < outlines_.size(); ++i) {
    const auto angle = [&](std::uint32_t turn) {
      return angles_[i] + turn * 2 * std::numbers::pi / kRotations;
    };
    ChartMask* const masks = sheet.masks.data() + i * kRotations;
    for (std::uint32_t turn = 0; turn < kRotations / 4; turn += kRotations / rotation_counts_[i]) {
      auto turned = make_turned_masks(outlines_[i], angle(turn), scale, margin);
      for (std::uint32_t quarter = 0; quarter < 4; ++quarter) {
        masks[turn + quarter * kRotations / 4] = std::move(turned[quarter]);
      }
    }
  }
  return sheet;
}

/// Records the place of an outline whose x, y and rotation are set. A negative rotation records it as left out.
void AtlasPacker::record_place(const AtlasBitmap& sheet, std::uint32_t outline,
                               PackedOutlines& packed) const {
  if (packed.turn[outline] < 0) {
    packed.left_out_area += outlines_[outline].area;
    packed.left_out_outlines.push_back(outline);
    return;
  }
  const ChartMask& mask = sheet.mask(outline, packed.turn[outline]);
  const std::uint32_t x = packed.x[outline], y = packed.y[outline];
  const double cell = static_cast<double>(size_) / sheet.cells;
  packed.places[outline] = {mask.turn, {(x + mask.shift.x) * cell, (y + mask.shift.y) * cell}};
  packed.height_weight += outlines_[outline].area * (y + mask.height);
  packed.height = std::max(packed.height, y + mask.height);
}

PackedOutlines AtlasPacker::pack(const AtlasBitmap& sheet, const PackOrder& order,
                                 double max_left_out_area, const PackedOutlines* done,
                                 std::size_t same) const {
  PackedOutlines packed;
  packed.places.assign(outlines_.size(), {});
  packed.turn.assign(outlines_.size(), -1);
  packed.x.assign(outlines_.size(), 0), packed.y = packed.x;
  std::uint32_t longest_run = 1;
  for (const ChartMask& mask : sheet.masks) {
    if (!mask.runs.empty())  // The first run of a mask is its longest.
      longest_run = std::max(longest_run, mask.runs[0].last - mask.runs[0].first + 1);
  }
  CellRows occupied_cells(sheet.cells, sheet.cells, longest_run);
  LowestRowsBySize lowest(outlines_.size());
  for (std::size_t n = 0; n < order.order.size(); ++n) {
    ProgressGuard::poll();
    const std::uint32_t i = order.order[n];
    std::uint32_t& bottom = lowest.of(outlines_[i], sheet.masks[std::size_t{i} * kRotations]);
    if (n < same) {
      packed.turn[i] = done->turn[i], packed.x[i] = done->x[i], packed.y[i] = done->y[i];
    } else {
      if (n == same && n > 0) occupied_cells.dilate(0, sheet.cells, 0, sheet.cells - 1);
      find_lowest_place(occupied_cells, sheet, order, i,
                        done != nullptr ? done->turn[i] : std::int8_t{-1}, bottom, packed);
    }
    record_place(sheet, i, packed);
    if (packed.left_out_area > max_left_out_area) return packed;
    if (packed.turn[i] < 0) continue;
    const ChartMask& mask = sheet.mask(i, packed.turn[i]);
    if (n < same) {
      occupied_cells.mark(mask, packed.x[i], packed.y[i]);
    } else {
      occupied_cells.occupy(mask, packed.x[i], packed.y[i]);
      // Outlines of another shape may fit slightly lower, so the row is lowered by the mask's height.
      bottom = std::max(bottom, packed.y[i] - std::min(packed.y[i], mask.height));
    }
  }
  return packed;
}

}  // namespace kiln
