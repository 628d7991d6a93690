#include "pack/many_packing.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "pack/box_packing.h"

namespace kiln {
namespace {

/// Cells a side: finer ones than for few outlines, since each outline loses about half a cell all around.
constexpr std::uint32_t kCells = 2048;
/// Orders packed side by side, and rounds of them: so many over the number of outlines, but some.
constexpr std::uint32_t kTogether = 4, kRounds = 9000, kLeastRounds = 3, kMostRounds = 16;
/// Share of the square tried first, and steps to other shares.
constexpr double kFirstShareOfMany = 0.75, kStep = 1.006, kLeastStepOfMany = 1.003;
/// Outlines change places that differ in size by this share.
constexpr double kMix = 0.3;
constexpr int kMostStarts = 24;
/// Above this many outlines, the first scale lets widened outlines fill this share of the square; each loses
/// so many cells all around. Steps to other shares, and when that ends.
constexpr std::uint32_t kThousand = 1000;
constexpr double kLikelyFill = 0.8, kLostCells = 0.5, kFarStep = 1.03, kNearStep = 1.012;
/// Above a step, packing goes on after so many rounds in vain by a smaller one.
constexpr std::uint32_t kPatienceOfMany = 3;

class ManyPacking {
 public:
  ManyPacking(std::span<const Outline> outlines, std::uint32_t size, double padding, int threads)
      : sheets_(outlines, size, padding),
        size_(size),
        cells_(kCells),
        margin_(0.5 * padding * kCells / size),
        threads_(threads) {}

  OutlinePacking run() {
    const auto count = static_cast<std::uint32_t>(sheets_.outlines().size());
    const double likely = count > kThousand ? likely_share() : 0;
    if (likely > 0) {
      begin_near(likely);
    } else {
      begin();
    }
    if (share_ == 0) return {};
    const std::uint32_t rounds = std::clamp(kRounds / count, kLeastRounds, kMostRounds);
    double step = kStep;
    std::uint32_t waited = 0;
    draw(share_ * step);
    for (std::uint32_t round = 0; round < rounds; ++round) {
      if (improve(round)) {
        draw(share_ * step);
        waited = 0;
      } else if (++waited == kPatienceOfMany) {
        step = std::max(kLeastStepOfMany, std::sqrt(step));
        draw(share_ * step);
        waited = 0;
      }
    }
    return {std::sqrt(share_ / sheets_.area()) * size_, std::move(best_.places)};
  }

 private:
  void draw(double share) {
    drawn_share_ = share;
    sheet_ = sheets_.draw(cells_, std::sqrt(share / sheets_.area()) * cells_);
  }

  /// The largest first: by area, or by area and the box's longer side.
  /// \param random  mixes outlines of nearly the same size; or null
  PackOrder by_size(bool by_box, std::mt19937* random = nullptr) const {
    std::vector<std::pair<double, std::uint32_t>> keys;
    for (std::uint32_t i = 0; i < sheets_.outlines().size(); ++i) {
      const ChartMask& mask = sheet_.masks[std::size_t{i} * AtlasPacker::kTurns];
      const double box = by_box ? std::max(mask.width, mask.height) : 1;
      const double by = random != nullptr ? 1 + kMix * random_below(*random, 1024) / 1024 : 1;
      keys.emplace_back(-by * box * std::sqrt(sheets_.outlines()[i].area), i);
    }
    std::sort(keys.begin(), keys.end());
    PackOrder plan;
    for (const auto& [key, i] : keys) plan.order.push_back(i);
    plan.turn.assign(keys.size(), -1);
    return plan;
  }

  /// A share that may just fit, of outlines that are small beside the padding: what they cover with it.
  double likely_share() const {
    double length = 0, rings = 0;
    for (const Outline& outline : sheets_.outlines()) {
      for (const auto& ring : outline.rings) {
        rings += 1;
        for (std::size_t i = 0; i < ring.size(); ++i) {
          const Vec2d side = ring[(i + 1) % ring.size()] - ring[i];
          length += std::sqrt(dot(side, side));
        }
      }
    }
    // A widened outline adds a strip along its length and a disc to its area.
    const double margin = margin_ + kLostCells;
    const double strip = 0.5 * margin * length / sheets_.area();
    const double room = kLikelyFill * cells_ * cells_ - std::numbers::pi * margin * margin * rings;
    if (room <= 0) return 0;
    const double scale = std::sqrt(strip * strip + room / sheets_.area()) - strip;
    return sheets_.area() * scale * scale / (1.0 * cells_ * cells_);
  }

  /// A share at which not all fit: whichever way an outline is turned, its box has a side of 1 / sqrt(2) of its length.
  /// Masks of what is far too long would take time by the square of the length.
  double too_large() const {
    double longest = 0;  // squared
    for (const Outline& outline : sheets_.outlines()) {
      for (const auto& ring : outline.rings) {
        for (const Vec2d& p : ring) longest = std::max(longest, dot(p - ring[0], p - ring[0]));
      }
    }
    return longest > 2 * sheets_.area() ? 2 * sheets_.area() / longest : 1;
  }

  /// As begin(), of so many outlines that each order takes long. What does not fit ends at once.
  void begin_near(double share) {
    double fails = too_large();
    share = std::min(share, fails);
    for (int i = 0; i < kMostStarts && share > 0; ++i) {
      draw(share);
      PackOrder plan = by_size(true);
      Packed packed = sheets_.pack(sheet_, plan, 0);
      if (packed.refused.empty()) {
        const double rows = static_cast<double>(packed.height) / cells_;
        keep(share, plan, packed);
        share = std::min(share / rows * kFarStep, 0.5 * (share + fails));
      } else {
        fails = share;
        share = share_ > 0 ? 0.5 * (share_ + fails) : share / kFarStep;
      }
      if (share_ > 0 && fails < share_ * kNearStep) break;
    }
    current_ = best_;
  }

  void keep(double share, PackOrder& plan, Packed& packed) {
    share_ = share;
    order_ = std::move(plan);
    best_ = std::move(packed);
  }

  /// The largest share, or nearly, at which an order by size fits.
  void begin() {
    double fails = too_large(), share = std::min(kFirstShareOfMany, fails);
    for (int i = 0; i < kMostStarts && share > 0; ++i) {
      draw(share);
      PackOrder plan = by_size(true);
      // Once one is known to fit, the others' remainders do not matter.
      Packed packed = sheets_.pack(sheet_, plan, share_ > 0 ? 0 : sheets_.area());
      const double left_out = packed.left_out / sheets_.area();
      if (left_out > 0) {
        fails = share;
        const double less = share * std::clamp(1 - left_out, 0.5, 0.99);
        share = share_ > 0 ? 0.5 * (share_ + fails) : less;
      } else {
        const double rows = static_cast<double>(packed.height) / cells_;
        keep(share, plan, packed);
        share = std::min(share / rows, 0.5 * (share + fails));
      }
      if (share_ > 0 && (share < share_ * kStep || fails < share_ * kStep)) break;
    }
    current_ = best_;
  }

  PackOrder changed(std::uint32_t round, std::uint32_t which) const {
    const std::uint32_t seed = round * kTogether + which;
    if (round == 0) {
      PackOrder plan = by_size(which % 2 == 0);
      plan.rule = which / 2;
      return plan;
    }
    std::mt19937 random(seed);
    if (which >= kTogether / 2) {
      PackOrder plan = by_size(which % 2 == 0, &random);
      plan.rule = order_.rule;
      return plan;
    }
    PackOrder plan = order_;
    // Refused outlines go earlier.
    for (const std::uint32_t i : current_.refused) {
      const auto at = std::find(plan.order.begin(), plan.order.end(), i);
      const auto place = static_cast<std::size_t>(at - plan.order.begin());
      std::rotate(plan.order.begin() + random_below(random, place + 1), at, at + 1);
    }
    const auto count = static_cast<std::uint32_t>(plan.order.size());
    for (std::uint32_t n = 0; n <= which; ++n) {
      const std::uint32_t a = random_below(random, count),
                          b = std::min(count - 1, a + 1 + random_below(random, 8));
      std::swap(plan.order[a], plan.order[b]);
    }
    return plan;
  }

  /// Packs some orders. \returns whether one fits
  bool improve(std::uint32_t round) {
    std::array<PackOrder, kTogether> plans;
    std::array<Packed, kTogether> results;
    // Orders that leave out more are rejected.
    const double most = current_.refused.empty() ? sheets_.area() : current_.left_out;
    // For very many outlines the first order that fits is taken. Later ones do not matter, whether they were
    // packed or not.
    const bool is_first_enough = sheets_.outlines().size() > kThousand;
    std::atomic<std::size_t> first{kTogether};
    const auto body = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (is_first_enough && i > first) continue;
        plans[i] = changed(round, static_cast<std::uint32_t>(i));
        results[i] = sheets_.pack(sheet_, plans[i], most);
        if (!results[i].refused.empty()) continue;
        for (std::size_t now = first; i < now && !first.compare_exchange_weak(now, i);) {
        }
      }
    };
    parallel_for(kTogether, 1, body, threads_);
    std::size_t best = 0;
    if (is_first_enough && first < kTogether) {
      best = first;
    } else {
      for (std::size_t i = 1; i < kTogether; ++i) {
        if (std::tie(results[i].left_out, results[i].weight) <
            std::tie(results[best].left_out, results[best].weight))
          best = i;
      }
    }
    if (results[best].refused.empty()) {
      share_ = drawn_share_;
      best_ = current_ = std::move(results[best]);
      order_ = std::move(plans[best]);
      return true;
    }
    if (current_.refused.empty() || results[best].left_out <= current_.left_out) {
      current_ = std::move(results[best]);
      order_ = std::move(plans[best]);
    }
    return false;
  }

  AtlasPacker sheets_;
  std::uint32_t size_, cells_;
  double margin_;  ///< Cells that outlines are widened by.
  int threads_;
  double share_ = 0;  ///< Share of the square that fits.
  Packed best_;       ///< And how.
  // The current attempt, a little too large.
  double drawn_share_ = 0;
  AtlasBitmap sheet_;
  PackOrder order_;
  Packed current_;
};

}  // namespace

OutlinePacking pack_many(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         int threads) {
  OutlinePacking boxes = pack_boxes(outlines, size, padding);
  OutlinePacking packing = ManyPacking(outlines, size, padding, threads).run();
  return packing.scale > boxes.scale ? std::move(packing) : std::move(boxes);
}

}  // namespace kiln
