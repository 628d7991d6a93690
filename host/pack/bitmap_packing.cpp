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

/// Cells a side; finer ones of more outlines than kMany, since each loses about half a cell all around.
constexpr std::uint32_t kCells = 256, kCellsOfMany = 2048;
constexpr std::size_t kMany = 100;
/// Orders tried after the first ones: at most this, over the squared number of outlines, since each takes
/// longer, too; but some. Of few outlines at most this, times the squared number.
constexpr std::uint32_t kMostEffort = 120000, kLeastTries = 4, kFewEffort = 8;
/// Searches side by side, and what each tries.
constexpr std::uint32_t kSearches = 4, kSearchTries = 120;
/// Those of few outlines go on by other numbers until they cover this share: so many times at most, the last from orders
/// by size.
constexpr double kWanted = 0.785;
constexpr std::uint32_t kSearchRounds = 3;
/// Share of the square that outlines are drawn for at first; and what they fill of it with the padding, or the half
/// cell that each loses all around.
constexpr double kFirstShare = 0.72, kLikelyFill = 0.8, kLostCells = 0.5, kLeastShare = 1e-4;
/// A scale is tried this often before a smaller one is; less often, where there are few tries.
constexpr std::uint32_t kPatience = 20;
/// At the least step the search ends after so many.
constexpr std::uint32_t kStuck = 60;
/// The least step to a larger scale, and the largest.
constexpr double kLeastStep = 1.004, kMostStep = 1.1;

class Search {
 public:
  Search(const AtlasPacker& sheets, std::uint32_t size, double padding, std::uint32_t seed)
      : sheets_(sheets),
        cells_(sheets.outlines().size() > kMany ? kCellsOfMany : std::min(size, kCells)),
        margin_(0.5 * padding * cells_ / size),
        random_(seed) {}

  PackState run(std::uint32_t effort, const PackState* from) {
    const auto count = static_cast<std::uint32_t>(sheets_.outlines().size());
    const std::uint32_t most = std::min(effort, kFewEffort * count * count);
    const std::uint32_t tries =
        std::clamp(kMostEffort / std::max(1U, count * count), std::min(kLeastTries, most), most);
    if (from == nullptr || from->order.order.empty()) {
      begin();
    } else if (from->packed.places.empty()) {
      begin_with(*from);
    } else {
      state_ = *from;
    }
    state_.angles = sheets_.angles();
    if (state_.share == 0 || count == 0) return std::move(state_);
    const double ahead = state_.attempt_share > state_.share
                             ? std::sqrt(state_.attempt_share / state_.share)
                             : step_after(state_.packed);
    patience_ = std::clamp(tries / 4, 1U, kPatience);
    aim(ahead, state_.attempt_share > 0 ? state_.attempt : state_.order);
    for (std::uint32_t i = 0; i < tries && waited_ < kStuck; ++i) improve();
    state_.attempt = std::move(order_);
    state_.attempt_share = share_of(sheet_);
    return std::move(state_);
  }

 private:
  double share_of(const AtlasBitmap& sheet) const {
    const double side = sheet.scale / sheet.cells;
    return sheets_.area() * side * side;
  }
  double scale_of(double share) const { return std::sqrt(share / sheets_.area()) * cells_; }

  double step_after(const Packed& packed) const {
    return std::clamp(std::sqrt(static_cast<double>(cells_) / packed.height), kLeastStep,
                      kMostStep);
  }

  /// The largest first: by area, or by area and the box's longer side.
  PackOrder by_size(const AtlasBitmap& sheet, bool by_box) const {
    std::vector<std::tuple<double, std::uint32_t>> keys;
    for (std::uint32_t i = 0; i < sheets_.outlines().size(); ++i) {
      const ChartMask& mask = sheet.masks[std::size_t{i} * AtlasPacker::kTurns];
      const double box = by_box ? std::max(mask.width, mask.height) : 1;
      keys.emplace_back(-box * std::sqrt(sheets_.outlines()[i].area), i);
    }
    std::sort(keys.begin(), keys.end());
    PackOrder plan;
    for (const auto& [key, i] : keys) plan.order.push_back(i);
    plan.turn.assign(sheets_.outlines().size(), -1);
    return plan;
  }

  static auto rank(const Packed& packed) { return std::tie(packed.left_out, packed.weight); }

  /// A share that may just fit: of outlines that are small beside the padding, what they cover with it.
  double likely_share() const {
    double length = 0, rings = 0, longest = 0;
    for (const Outline& outline : sheets_.outlines()) {
      for (const auto& ring : outline.rings) {
        rings += 1;
        for (std::size_t i = 0; i < ring.size(); ++i) {
          const Vec2d side = ring[(i + 1) % ring.size()] - ring[i], reach = ring[i] - ring[0];
          length += std::sqrt(dot(side, side));
          longest = std::max(longest, dot(reach, reach));
        }
      }
    }
    // A widened outline adds a strip along its length and a disc to its area.
    const double margin = margin_ + kLostCells, area = sheets_.area();
    const double strip = 0.5 * margin * length / area;
    const double room = kLikelyFill * cells_ * cells_ - std::numbers::pi * margin * margin * rings;
    if (room <= 0) return kLeastShare;
    const double scale = std::sqrt(strip * strip + room / area) - strip;
    // Whichever way an outline is turned, its box has a side of 1 / sqrt(2) of its length. Masks of what is far too
    // long would take time by the square of the length.
    return std::min(area * scale * scale / (1.0 * cells_ * cells_), 2 * area / longest);
  }

  /// Orders by size, at a scale at which the best of them fits.
  void begin() {
    constexpr int kMostRounds = 24;
    double share = std::min(kFirstShare, likely_share());
    Packed best;
    for (int round = 0; round < kMostRounds; ++round) {
      AtlasBitmap sheet = sheets_.draw(cells_, scale_of(share));
      for (const bool by_box : {true, false}) {
        PackOrder plan = by_size(sheet, by_box);
        const double most = by_box ? sheets_.area() : best.left_out;
        Packed packed = sheets_.pack(sheet, plan, most, round == 0 && by_box ? nullptr : &best);
        if (!by_box && rank(packed) >= rank(best)) continue;
        best = std::move(packed);
        state_.order = std::move(plan);
      }
      if (best.refused.empty()) {
        state_.share = share;
        state_.packed = std::move(best);
        return;
      }
      share *= std::clamp(1 - best.left_out / sheets_.area(), 0.5, 0.95);
    }
  }

  /// A known order, at the largest scale near the known one at which it fits.
  void begin_with(const PackState& known) {
    constexpr double kSmaller = 0.99;
    constexpr int kMostRounds = 12;
    double share = known.share;
    for (int round = 0; round < kMostRounds; ++round, share *= kSmaller) {
      state_.packed = sheets_.pack(sheets_.draw(cells_, scale_of(share)), known.order, 0);
      if (!state_.packed.refused.empty()) continue;
      state_.order = known.order;
      state_.share = share;
      return;
    }
    begin();
  }

  /// Draws outlines larger than what fits by this factor; again where they still fit.
  void aim(double factor, PackOrder order) {
    for (;;) {
      factor_ = factor;
      waited_ = 0;
      sheet_ = sheets_.draw(cells_, scale_of(state_.share) * factor);
      current_ =
          sheets_.pack(sheet_, order, std::numeric_limits<double>::infinity(), &state_.packed);
      order_ = std::move(order);
      if (!current_.refused.empty()) return;
      factor = keep();
      order = order_;
    }
  }

  /// Takes over what fits. \returns the next step
  double keep() {
    state_.share = share_of(sheet_);
    state_.order = order_;
    state_.packed = current_;
    return step_after(current_);
  }

  void improve() {
    PackOrder plan = changed();
    Packed packed = sheets_.pack(sheet_, plan, current_.left_out, &current_, same_until(plan));
    if (rank(packed) <= rank(current_)) {
      const bool better = packed.left_out < current_.left_out;
      current_ = std::move(packed);
      order_ = std::move(plan);
      if (current_.refused.empty()) return aim(keep(), order_);
      if (better) waited_ = 0;
    }
    if (++waited_ >= patience_ && factor_ > kLeastStep) {
      aim(std::max(kLeastStep, std::sqrt(factor_)), order_);
    }
  }

  /// Counts the leading outlines that keep their place of the current order.
  std::size_t same_until(const PackOrder& plan) const {
    std::size_t n = 0;
    for (; n < plan.order.size() && plan.order[n] == order_.order[n]; ++n) {
      if (plan.turn[plan.order[n]] != order_.turn[plan.order[n]]) break;
    }
    return n;
  }

  PackOrder changed() {
    PackOrder plan = order_;
    const auto count = static_cast<std::uint32_t>(plan.order.size());
    const auto below = [&](std::size_t n) { return random_below(random_, n); };
    const std::uint32_t kind = below(7);
    if (kind < 4) {  // A refused outline goes earlier.
      const std::uint32_t i = current_.refused[below(current_.refused.size())];
      const auto at = std::find(plan.order.begin(), plan.order.end(), i);
      const auto place = static_cast<std::uint32_t>(at - plan.order.begin());
      std::rotate(plan.order.begin() + below(place + 1), at, at + 1);
      plan.turn[i] = -1;
    } else if (kind < 5) {
      const std::uint32_t a = below(count), b = std::min(count - 1, a + 1 + below(4));
      std::swap(plan.order[a], plan.order[b]);
    } else {  // Among the largest, another turn.
      const std::uint32_t i = plan.order[below(std::min(count, 16U))];
      const std::uint32_t step = AtlasPacker::kTurns / sheets_.turns_of(i);
      plan.turn[i] = static_cast<std::int8_t>(below(sheets_.turns_of(i)) * step);
    }
    return plan;
  }

  const AtlasPacker& sheets_;
  std::uint32_t cells_;
  double margin_;  ///< Cells that outlines are widened by.
  std::mt19937 random_;
  PackState state_;
  // The current attempt, a little too large.
  double factor_ = 1;         ///< Over the scale that fits.
  std::uint32_t waited_ = 0;  ///< Tries since it became better.
  std::uint32_t patience_ = kPatience;
  AtlasBitmap sheet_;
  PackOrder order_;
  Packed current_;
};

}  // namespace

PackState search_packing(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         std::uint32_t effort, std::uint32_t seed, const PackState* from) {
  const AtlasPacker sheets(outlines, size, padding,
                           from != nullptr ? from->angles : std::vector<double>());
  return Search(sheets, size, padding, seed).run(effort, from);
}

OutlinePacking pack_outlines(std::span<const Outline> outlines, std::uint32_t size, double padding,
                             const PackState* from, int threads) {
  PackState best;
  if (from != nullptr) best = *from;
  best.packed = {};  // Other outlines may not fit in the same places.
  best = search_packing(outlines, size, padding, 0, 1, from != nullptr ? &best : nullptr);
  if (best.share == 0) return {};
  std::array<PackState, kSearches> searches;
  PackState start = best;
  const std::uint32_t rounds = outlines.size() > kMany ? 1 : kSearchRounds;
  for (std::uint32_t round = 0; round < rounds && (round == 0 || best.share < kWanted); ++round) {
    if (round + 1 == kSearchRounds) {  // All begin alike: by size, which no seed changes.
      if (from != nullptr) start = search_packing(outlines, size, padding, 0, 1);
      if (start.share == 0) break;
      start.attempt = {};
      start.attempt_share = 0;
    }
    const auto body = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t seed = round * kSearches + static_cast<std::uint32_t>(i) + 1;
        searches[i] = search_packing(outlines, size, padding, kSearchTries, seed, &start);
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
