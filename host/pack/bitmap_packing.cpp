#include "pack/bitmap_packing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <tuple>
#include <utility>

#include "base/parallel.h"

namespace kiln {
namespace {

/// Cells per side of the grid: kCoarseGridCells for up to kFineGridOutlines outlines, kFineGridCells for more.
/// Rasterising widens each outline by about half a cell, so more outlines need smaller cells.
constexpr std::uint32_t kCoarseGridCells = 256, kFineGridCells = 2048;
constexpr std::size_t kFineGridOutlines = 100;
/// Number of tried orders for n outlines: kMaxTriesTimesSquare / n^2, since each try takes longer, too; but at least
/// kMinTries, and at most kMaxTriesPerSquare * n^2, since few outlines have few orders.
constexpr std::uint32_t kMaxTriesTimesSquare = 120000, kMinTries = 4, kMaxTriesPerSquare = 8;
/// Number of parallel searches, and number of orders that each of them tries.
constexpr std::uint32_t kSearches = 4, kTriesPerSearch = 120;
/// If there are at most kFineGridOutlines outlines, rounds of searches with new seeds follow each other until the
/// outlines cover this share, up to kSearchRounds rounds. The last round starts again from outlines sorted by size.
constexpr double kTargetCoverage = 0.785;
constexpr std::uint32_t kSearchRounds = 3;
/// The first scale is that at which outlines cover the share kMaxFirstCoverage of the square. It is smaller if the
/// outlines with their padding, widened by kRasterizationMarginCells, would cover more than kLikelyCoverage of the
/// square. If padding alone covers that share, the first scale is that for kMinFirstCoverage.
constexpr double kMaxFirstCoverage = 0.72, kLikelyCoverage = 0.8, kRasterizationMarginCells = 0.5,
                 kMinFirstCoverage = 1e-4;
/// Maximum number of tries without progress at one scale before a smaller one is tried; fewer if the total number of
/// tries is small.
constexpr std::uint32_t kMaxTriesPerScale = 20;
/// If the scale step is kMinScaleStep, the search stops after this number of tries without progress.
constexpr std::uint32_t kMaxTriesWithoutProgress = 60;
/// Smallest and largest factor between consecutive scales.
constexpr double kMinScaleStep = 1.004, kMaxScaleStep = 1.1;

class PackingSearch {
 public:
  PackingSearch(const AtlasPacker& packer, std::uint32_t size, double padding, std::uint32_t seed)
      : packer_(packer),
        grid_cells_(packer.outlines().size() > kFineGridOutlines
                        ? kFineGridCells
                        : std::min(size, kCoarseGridCells)),
        half_padding_cells_(0.5 * padding * grid_cells_ / size),
        random_(seed) {}

  PackState run(std::uint32_t effort, const PackState* from) {
    const auto count = static_cast<std::uint32_t>(packer_.outlines().size());
    const std::uint32_t most = std::min(effort, kMaxTriesPerSquare * count * count);
    const std::uint32_t tries = std::clamp(kMaxTriesTimesSquare / std::max(1U, count * count),
                                           std::min(kMinTries, most), most);
    if (from == nullptr || from->order.order.empty()) {
      begin();
    } else if (from->packed.places.empty()) {
      begin_with_order(*from);
    } else {
      state_ = *from;
    }
    state_.angles = packer_.angles();
    if (state_.share == 0 || count == 0) return std::move(state_);
    const double scale_factor = state_.attempt_coverage > state_.share
                                    ? std::sqrt(state_.attempt_coverage / state_.share)
                                    : scale_step_after(state_.packed);
    max_tries_at_scale_ = std::clamp(tries / 4, 1U, kMaxTriesPerScale);
    start_attempt(scale_factor, state_.attempt_coverage > 0 ? state_.attempt : state_.order);
    for (std::uint32_t i = 0; i < tries && tries_without_progress_ < kMaxTriesWithoutProgress; ++i)
      try_random_change();
    state_.attempt = std::move(order_);
    state_.attempt_coverage = covered_share_at(current_masks_);
    return std::move(state_);
  }

 private:
  double covered_share_at(const AtlasBitmap& sheet) const {
    const double side = sheet.scale / sheet.cells;
    return packer_.area() * side * side;
  }
  double scale_for_share(double share) const {
    return std::sqrt(share / packer_.area()) * grid_cells_;
  }

  double scale_step_after(const PackedOutlines& packed) const {
    return std::clamp(std::sqrt(static_cast<double>(grid_cells_) / packed.height), kMinScaleStep,
                      kMaxScaleStep);
  }

  /// Returns the order by decreasing size. The size is the square root of the area, optionally multiplied by the longer
  /// side of the bounding box.
  PackOrder order_by_size(const AtlasBitmap& sheet, bool by_box) const {
    std::vector<std::tuple<double, std::uint32_t>> keys;
    for (std::uint32_t i = 0; i < packer_.outlines().size(); ++i) {
      const ChartMask& mask = sheet.masks[std::size_t{i} * AtlasPacker::kRotations];
      const double box = by_box ? std::max(mask.width, mask.height) : 1;
      keys.emplace_back(-box * std::sqrt(packer_.outlines()[i].area), i);
    }
    std::sort(keys.begin(), keys.end());
    PackOrder plan;
    for (const auto& [key, i] : keys) plan.order.push_back(i);
    plan.turn.assign(packer_.outlines().size(), -1);
    return plan;
  }

  static auto rank(const PackedOutlines& packed) {
    return std::tie(packed.left_out_area, packed.height_weight);
  }

  /// Estimates the share of the square that the outlines can cover. It is low if outlines are small relative
  /// to the padding.
  double estimate_share() const {
    double length = 0, ring_count = 0, longest = 0;
    for (const Outline& outline : packer_.outlines()) {
      for (const auto& ring : outline.rings) {
        ring_count += 1;
        for (std::size_t i = 0; i < ring.size(); ++i) {
          const Vec2d side = ring[(i + 1) % ring.size()] - ring[i], offset = ring[i] - ring[0];
          length += std::sqrt(dot(side, side));
          longest = std::max(longest, dot(offset, offset));
        }
      }
    }
    // Widening an outline adds a strip along each ring and one disc per ring to its area.
    const double margin = half_padding_cells_ + kRasterizationMarginCells, area = packer_.area();
    const double widening_strip = 0.5 * margin * length / area;
    const double free_area = kLikelyCoverage * grid_cells_ * grid_cells_ -
                             std::numbers::pi * margin * margin * ring_count;
    if (free_area <= 0) return kMinFirstCoverage;
    const double scale =
        std::sqrt(widening_strip * widening_strip + free_area / area) - widening_strip;
    // At any rotation, an outline's bounding box has a side of at least 1 / sqrt(2) of its length, which gives an
    // upper bound of the scale. The bound also limits the cost of masks, which grows with the square of the length.
    return std::min(area * scale * scale / (1.0 * grid_cells_ * grid_cells_), 2 * area / longest);
  }

  /// Starts with the better of the two orders by size, at the first scale at which all outlines fit.
  void begin() {
    constexpr int kMaxRounds = 24;
    double share = std::min(kMaxFirstCoverage, estimate_share());
    PackedOutlines best;
    for (int round = 0; round < kMaxRounds; ++round) {
      AtlasBitmap sheet = packer_.draw(grid_cells_, scale_for_share(share));
      for (const bool by_box : {true, false}) {
        PackOrder plan = order_by_size(sheet, by_box);
        const double most = by_box ? packer_.area() : best.left_out_area;
        PackedOutlines packed =
            packer_.pack(sheet, plan, most, round == 0 && by_box ? nullptr : &best);
        if (!by_box && rank(packed) >= rank(best)) continue;
        best = std::move(packed);
        state_.order = std::move(plan);
      }
      if (best.left_out_outlines.empty()) {
        state_.share = share;
        state_.packed = std::move(best);
        return;
      }
      share *= std::clamp(1 - best.left_out_area / packer_.area(), 0.5, 0.95);
    }
  }

  /// Starts with a known order, at the largest scale at which all outlines fit; it is at most the known scale.
  void begin_with_order(const PackState& known) {
    constexpr double kScaleStep = 0.99;
    constexpr int kMaxRounds = 12;
    double share = known.share;
    for (int round = 0; round < kMaxRounds; ++round, share *= kScaleStep) {
      state_.packed =
          packer_.pack(packer_.draw(grid_cells_, scale_for_share(share)), known.order, 0);
      if (!state_.packed.left_out_outlines.empty()) continue;
      state_.order = known.order;
      state_.share = share;
      return;
    }
    begin();
  }

  /// Starts an attempt at the largest scale that fits, times `factor`; repeats this while all outlines fit.
  void start_attempt(double factor, PackOrder order) {
    for (;;) {
      scale_step_ = factor;
      tries_without_progress_ = 0;
      current_masks_ = packer_.draw(grid_cells_, scale_for_share(state_.share) * factor);
      current_ = packer_.pack(current_masks_, order, std::numeric_limits<double>::infinity(),
                              &state_.packed);
      order_ = std::move(order);
      if (!current_.left_out_outlines.empty()) return;
      factor = store_attempt();
      order = order_;
    }
  }

  /// Stores the current attempt as the best that fits. \returns the factor to the next scale
  double store_attempt() {
    state_.share = covered_share_at(current_masks_);
    state_.order = order_;
    state_.packed = current_;
    return scale_step_after(current_);
  }

  void try_random_change() {
    PackOrder plan = changed_order();
    PackedOutlines packed = packer_.pack(current_masks_, plan, current_.left_out_area, &current_,
                                         common_prefix_length(plan));
    if (rank(packed) <= rank(current_)) {
      const bool has_improved = packed.left_out_area < current_.left_out_area;
      current_ = std::move(packed);
      order_ = std::move(plan);
      if (current_.left_out_outlines.empty()) return start_attempt(store_attempt(), order_);
      if (has_improved) tries_without_progress_ = 0;
    }
    if (++tries_without_progress_ >= max_tries_at_scale_ && scale_step_ > kMinScaleStep) {
      start_attempt(std::max(kMinScaleStep, std::sqrt(scale_step_)), order_);
    }
  }

  /// Number of leading outlines that have the same position and rotation as in the current order, and thus keep their
  /// places.
  std::size_t common_prefix_length(const PackOrder& plan) const {
    std::size_t n = 0;
    for (; n < plan.order.size() && plan.order[n] == order_.order[n]; ++n) {
      if (plan.turn[plan.order[n]] != order_.turn[plan.order[n]]) break;
    }
    return n;
  }

  PackOrder changed_order() {
    PackOrder plan = order_;
    const auto count = static_cast<std::uint32_t>(plan.order.size());
    const auto below = [&](std::size_t n) { return random_below(random_, n); };
    const std::uint32_t kind = below(7);
    if (kind < 4) {  // Moves an outline that was left out to an earlier position in the order
      const std::uint32_t i = current_.left_out_outlines[below(current_.left_out_outlines.size())];
      const auto at = std::find(plan.order.begin(), plan.order.end(), i);
      const auto place = static_cast<std::uint32_t>(at - plan.order.begin());
      std::rotate(plan.order.begin() + below(place + 1), at, at + 1);
      plan.turn[i] = -1;
    } else if (kind < 5) {
      const std::uint32_t a = below(count), b = std::min(count - 1, a + 1 + below(4));
      std::swap(plan.order[a], plan.order[b]);
    } else {  // Changes the rotation of one of the first 16 outlines
      const std::uint32_t i = plan.order[below(std::min(count, 16U))];
      const std::uint32_t step = AtlasPacker::kRotations / packer_.rotation_count(i);
      plan.turn[i] = static_cast<std::int8_t>(below(packer_.rotation_count(i)) * step);
    }
    return plan;
  }

  const AtlasPacker& packer_;
  std::uint32_t grid_cells_;
  double half_padding_cells_;  ///< Number of cells by which outlines are widened on each side
  std::mt19937 random_;
  PackState state_;
  // The members below describe the current attempt, at a scale at which some outlines do not fit yet.
  /// Scale of the attempt, divided by the largest scale at which all outlines fit
  double scale_step_ = 1;
  /// Number of tries since the area of left-out outlines last decreased
  std::uint32_t tries_without_progress_ = 0;
  std::uint32_t max_tries_at_scale_ = kMaxTriesPerScale;
  AtlasBitmap current_masks_;
  PackOrder order_;
  PackedOutlines current_;
};

}  // namespace

PackState search_packing(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         std::uint32_t effort, std::uint32_t seed, const PackState* from) {
  const AtlasPacker packer(outlines, size, padding,
                           from != nullptr ? from->angles : std::vector<double>());
  return PackingSearch(packer, size, padding, seed).run(effort, from);
}

OutlinePacking pack_outlines(std::span<const Outline> outlines, std::uint32_t size, double padding,
                             const PackState* from, int threads) {
  PackState best;
  if (from != nullptr) best = *from;
  // The outlines may have changed, so the places of the earlier search are invalid
  best.packed = {};
  best = search_packing(outlines, size, padding, 0, 1, from != nullptr ? &best : nullptr);
  if (best.share == 0) return {};
  std::array<PackState, kSearches> searches;
  PackState start = best;
  const std::uint32_t rounds = outlines.size() > kFineGridOutlines ? 1 : kSearchRounds;
  for (std::uint32_t round = 0; round < rounds && (round == 0 || best.share < kTargetCoverage);
       ++round) {
    // All searches of the last round start from the outlines sorted by size, regardless of their
    // seeds.
    if (round + 1 == kSearchRounds) {
      if (from != nullptr) start = search_packing(outlines, size, padding, 0, 1);
      if (start.share == 0) break;
      start.attempt = {};
      start.attempt_coverage = 0;
    }
    const auto body = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t seed = round * kSearches + static_cast<std::uint32_t>(i) + 1;
        searches[i] = search_packing(outlines, size, padding, kTriesPerSearch, seed, &start);
      }
    };
    parallel_for(searches.size(), 1, body, threads);
    for (PackState& state : searches) {
      if (state.share > best.share) best = std::move(state);
    }
  }
  double area = 0;
  for (const Outline& outline : outlines) area += outline.area;
  return {std::sqrt(best.share / area) * size, std::move(best.packed.places)};
}

}  // namespace kiln
