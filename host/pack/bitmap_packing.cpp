#include "pack/bitmap_packing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

#include "base/parallel.h"

namespace kiln {
namespace {

/// Cells a side: to look for an order, and for the last step.
constexpr std::uint32_t kSearchCells = 256, kFinalCells = 1024;
/// Orders tried after the first ones: at most this, over the squared number of outlines, since each takes
/// longer, too; but some. Of few outlines at most this, times the squared number.
constexpr std::uint32_t kMostEffort = 120000, kLeastTries = 4, kFewEffort = 8;
/// Searches side by side, and what each tries.
constexpr std::uint32_t kSearches = 4, kSearchTries = 120;
/// They go on by other numbers until they cover this share: so many times at most, the last from orders by size.
constexpr double kWanted = 0.785;
constexpr std::uint32_t kSearchRounds = 3;
/// Share of the square that outlines are drawn for at first.
constexpr double kFirstShare = 0.72;
/// A scale is tried this often before a smaller one is; less often, where there are few tries.
constexpr std::uint32_t kPatience = 20;
/// At the least step the search ends after so many.
constexpr std::uint32_t kStuck = 60;
/// The least step to a larger scale, and the largest.
constexpr double kLeastStep = 1.004, kMostStep = 1.1;

/// Shares of the width by which outlines may move aside in the last step.
constexpr std::array<double, 4> kReaches{0.03, 0.012, 0.005, 0.001};

class Search {
 public:
  Search(const AtlasPacker& sheets, std::uint32_t size, std::uint32_t seed)
      : sheets_(sheets), cells_(std::min(size, kSearchCells)), random_(seed) {}

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

  /// Orders by size, at a scale at which the best of them fits.
  void begin() {
    constexpr int kMostRounds = 24;
    double share = kFirstShare;
    Packed best;
    for (int round = 0; round < kMostRounds; ++round) {
      AtlasBitmap sheet = sheets_.draw(cells_, scale_of(share));
      for (std::uint32_t v = 0; v < 2 * AtlasPacker::kRules; ++v) {
        PackOrder plan = by_size(sheet, v % 2 == 0);
        plan.rule = v / 2;
        const double most = v == 0 ? sheets_.area() : best.left_out;
        Packed packed = sheets_.pack(sheet, plan, most, round == 0 && v == 0 ? nullptr : &best);
        if (v != 0 && rank(packed) >= rank(best)) continue;
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
    if (plan.rule != order_.rule) return 0;
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
    const std::uint32_t kind = below(8);
    if (kind < 4) {  // A refused outline goes earlier.
      const std::uint32_t i = current_.refused[below(current_.refused.size())];
      const auto at = std::find(plan.order.begin(), plan.order.end(), i);
      const auto place = static_cast<std::uint32_t>(at - plan.order.begin());
      std::rotate(plan.order.begin() + below(place + 1), at, at + 1);
      plan.turn[i] = -1;
    } else if (kind < 5) {
      const std::uint32_t a = below(count), b = std::min(count - 1, a + 1 + below(4));
      std::swap(plan.order[a], plan.order[b]);
    } else if (kind < 7) {  // Among the largest, another turn.
      const std::uint32_t i = plan.order[below(std::min(count, 16U))];
      const std::uint32_t step = AtlasPacker::kTurns / sheets_.turns_of(i);
      plan.turn[i] = static_cast<std::int8_t>(below(sheets_.turns_of(i)) * step);
    } else {
      plan.rule = below(AtlasPacker::kRules);
      const std::uint32_t a = below(count), b = below(count);
      std::swap(plan.order[a], plan.order[b]);
    }
    return plan;
  }

  const AtlasPacker& sheets_;
  std::uint32_t cells_;
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

/// From the bottom up, each close to where it was.
PackOrder near(const Packed& packed, std::uint32_t cells, double reach) {
  PackOrder plan;
  plan.order.resize(packed.turn.size());
  std::iota(plan.order.begin(), plan.order.end(), 0U);
  plan.reach = reach;
  plan.turn = packed.turn;
  for (const std::uint32_t x : packed.x) plan.left.push_back(static_cast<double>(x) / cells);
  std::stable_sort(plan.order.begin(), plan.order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return packed.y[a] < packed.y[b]; });
  return plan;
}

/// Outlines go to nearly the same places with finer cells, as large as it fits the square.
OutlinePacking finish(const AtlasPacker& sheets, const PackState& state, std::uint32_t size,
                      int threads) {
  constexpr double kFirstFactor = 1.03, kStep = 0.0025;
  const std::uint32_t coarse = std::min(size, kSearchCells), cells = std::min(size, kFinalCells);
  const double base = std::sqrt(state.share / sheets.area());
  OutlinePacking packing{base * size, state.packed.places};
  if (cells == coarse) return packing;
  std::array<PackOrder, kReaches.size()> plans;
  for (std::size_t i = 0; i < plans.size(); ++i) plans[i] = near(state.packed, coarse, kReaches[i]);
  for (double factor = kFirstFactor; factor > 1;) {
    std::array<Packed, 4> results;
    std::array<double, 4> scales{};
    for (double& scale : scales) scale = base * factor * cells, factor -= kStep;
    const auto body = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const AtlasBitmap fine = sheets.draw(cells, scales[i], state.packed.turn);
        for (const PackOrder& plan : plans) {
          results[i] = sheets.pack(fine, plan, 0);
          if (results[i].refused.empty()) break;
        }
      }
    };
    parallel_for(results.size(), 1, body, threads);
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (!results[i].refused.empty() || scales[i] <= base * cells) continue;
      packing.scale = scales[i] * size / cells;
      packing.places = std::move(results[i].places);
      return packing;
    }
  }
  return packing;
}

}  // namespace

PackState search_packing(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         std::uint32_t effort, std::uint32_t seed, const PackState* from) {
  const AtlasPacker sheets(outlines, size, padding,
                           from != nullptr ? from->angles : std::vector<double>());
  return Search(sheets, size, seed).run(effort, from);
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
  for (std::uint32_t round = 0; round < kSearchRounds && (round == 0 || best.share < kWanted);
       ++round) {
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
  return finish(AtlasPacker(outlines, size, padding, best.angles), best, size, threads);
}

}  // namespace kiln
