#include "lowpoly/bitmap_packing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <tuple>

#include "base/heartbeat.h"
#include "base/parallel.h"
#include "lowpoly/cell_rows.h"

namespace kiln {
namespace {

/// Cells a side: to compare cuts, to look for an order, and for the last step.
constexpr std::uint32_t kEstimateCells = 256, kSearchCells = 512, kFinalCells = 1024;
/// Orders looked at together.
constexpr std::uint32_t kBatch = 4;
/// Batches after the first orders: this, over the squared number of outlines, since each takes longer, too.
constexpr std::uint32_t kSearchEffort = 18000, kLeastBatches = 2, kMostBatches = 30;
/// The order has room to be drawn larger, if it leaves more than this share of the rows.
constexpr double kFlatShare = 0.012;
/// An outline that stays close moves by at most this share of the width.
constexpr double kCloseBy = 0.03;
/// Share of the square that outlines are drawn for at first.
constexpr double kFirstShare = 0.72;

/// In which order outlines go, and where each wants to be.
struct Plan {
  std::vector<std::uint32_t> order;
  std::uint32_t rule = 0;
  std::vector<std::int8_t> turn;  ///< The only turn of an outline, or -1 for any.
  std::vector<double>
      left;  ///< Where an outline's left side should be, share of the width; or none.
};

struct Packed {
  bool whole = false;
  std::size_t failed = 0;    ///< The place in the order of the first that found no place.
  std::uint32_t height = 0;  ///< Rows.
  double weight = 0;         ///< Sum of area by top.
  std::vector<OutlinePlace> places;
  std::vector<std::int8_t> turn;  ///< That each outline got.
  std::vector<std::uint32_t> x, y;
  std::uint32_t top = 0;  ///< The outline that reaches farthest up.
};

/// Outlines drawn at one scale, at all turns.
struct Sheet {
  std::uint32_t cells = 0;
  double scale = 0;  ///< Cells per unit.
  std::vector<ChartMask> masks;
};

class Packer {
 public:
  Packer(std::span<const Outline> outlines, std::uint32_t size, double padding, std::uint32_t cells,
         int threads)
      : outlines_(outlines),
        threads_(threads),
        size_(size),
        cells_(std::min(size, cells)),
        padding_(padding),
        turns_(cells < kSearchCells ? 8 : kMostTurns) {
    for (const Outline& outline : outlines) {
      area_ += outline.area;
      angles_.push_back(best_box_angle(outline));
    }
    std::vector<std::uint32_t> largest = by_area();
    turns_of_.resize(outlines.size());
    for (std::size_t n = 0; n < largest.size(); ++n) {
      // Large outlines decide; small ones find gaps at few turns.
      turns_of_[largest[n]] = n < 12 ? turns_ : n < 32 ? turns_ / 2 : turns_ / 4;
    }
  }

  double expected(double tolerance) {
    const Sheet sheet = first_sheet(tolerance);
    if (sheet.cells == 0) return 0;
    return area_ * sheet.scale * sheet.scale / (1.0 * sheet.cells * best_.height);
  }

  OutlinePacking run() {
    Sheet sheet = first_sheet(0.04);
    if (sheet.cells == 0) return {};
    improve(sheet);
    return finish(sheet);
  }

 private:
  static constexpr std::uint32_t kMostTurns = 16, kRules = 3;

  std::vector<std::uint32_t> by_area() const {
    std::vector<std::uint32_t> order(outlines_.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return outlines_[a].area > outlines_[b].area;
    });
    return order;
  }

  /// \param only  of each outline the turn to draw, -1 for all
  Sheet draw(std::uint32_t cells, double scale, std::span<const std::int8_t> only = {}) const {
    Sheet sheet{cells, scale, std::vector<ChartMask>(outlines_.size() * turns_)};
    const double margin = 0.5 * padding_ * cells / size_;
    const auto body = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t step = turns_ / turns_of_[i];
        for (std::uint32_t turn = 0; turn < turns_; turn += step) {
          if (!only.empty() && only[i] >= 0 && only[i] != static_cast<std::int8_t>(turn)) continue;
          sheet.masks[i * turns_ + turn] = make_mask(
              outlines_[i], angles_[i] + turn * 2 * std::numbers::pi / turns_, scale, margin);
        }
      }
    };
    parallel_for(outlines_.size(), 1, body, threads_);
    return sheet;
  }

  /// The largest first: by area, or by area and the box's longer side.
  Plan first_plan(const Sheet& sheet, bool by_box) const {
    std::vector<std::tuple<double, std::uint32_t>> keys;
    for (std::uint32_t i = 0; i < outlines_.size(); ++i) {
      const ChartMask& mask = sheet.masks[std::size_t{i} * turns_];
      const double box = by_box ? std::max(mask.width, mask.height) : 1;
      keys.emplace_back(-box * std::sqrt(outlines_[i].area), i);
    }
    std::sort(keys.begin(), keys.end());
    Plan plan;
    for (const auto& [key, i] : keys) plan.order.push_back(i);
    plan.turn.assign(outlines_.size(), -1);
    return plan;
  }

  /// The score of a place, less is better.
  static std::uint32_t score(const ChartMask& mask, std::uint32_t x, std::uint32_t y,
                             std::uint32_t rule) {
    if (rule == 0) return 2 * (y + mask.height);
    if (rule == 1) return 2 * y + mask.height;
    return std::max(2 * (y + mask.height), x + mask.width);
  }

  /// \param rows  that there are
  Packed pack(const Sheet& sheet, const Plan& plan, std::uint32_t rows) const {
    Packed packed;
    packed.places.assign(outlines_.size(), {});
    packed.turn.assign(outlines_.size(), -1);
    packed.x.assign(outlines_.size(), 0), packed.y = packed.x;
    CellRows taken(sheet.cells, rows);
    const double cell = static_cast<double>(size_) / sheet.cells;
    for (std::size_t n = 0; n < plan.order.size(); ++n) {
      Heartbeat::beat();
      const std::uint32_t i = plan.order[n];
      const ChartMask* chosen = nullptr;
      std::uint32_t best = 0, x = 0, y = 0, limit = rows;
      for (std::uint32_t turn = 0; turn < turns_; ++turn) {
        const ChartMask& mask = sheet.masks[std::size_t{i} * turns_ + turn];
        if (mask.runs.empty()) continue;
        if (plan.turn[i] >= 0 && plan.turn[i] != static_cast<std::int8_t>(turn)) continue;
        CellRows::Window window{limit};
        if (!plan.left.empty()) {
          const double left = plan.left[i] * sheet.cells, reach = kCloseBy * sheet.cells;
          window.first = static_cast<std::uint32_t>(std::max(0.0, left - reach));
          window.last = static_cast<std::uint32_t>(left + reach);
        }
        const auto at = taken.find(mask, window);
        if (!at) continue;
        const std::uint32_t value = score(mask, at->first, at->second, plan.rule);
        if (chosen != nullptr && (value > best || (value == best && at->first >= x))) continue;
        best = value;
        x = at->first, y = at->second;
        chosen = &mask;
        packed.turn[i] = static_cast<std::int8_t>(turn);
        if (plan.rule != 1) limit = std::min(limit, best / 2);
      }
      if (chosen == nullptr) {
        packed.failed = n;
        return packed;
      }
      taken.take(*chosen, x, y);
      packed.x[i] = x, packed.y[i] = y;
      packed.places[i] = {chosen->turn,
                          {(x + chosen->shift.x) * cell, (y + chosen->shift.y) * cell}};
      packed.weight += outlines_[i].area * (y + chosen->height);
      if (y + chosen->height > packed.height) {
        packed.height = y + chosen->height;
        packed.top = i;
      }
    }
    packed.whole = true;
    return packed;
  }

  /// Sets best_ to the best of a few orders, at a scale at which they nearly fill the square.
  /// \param tolerance  of the rows that it takes, as a share of the square's
  Sheet first_sheet(double tolerance) {
    constexpr int kMostRounds = 24, kMostPacked = 4;
    Sheet found;
    Packed packed;
    Plan plan;
    double share = kFirstShare;
    int count = 0;
    for (int round = 0; round < kMostRounds && count < kMostPacked; ++round) {
      Sheet sheet = draw(cells_, std::sqrt(share / area_) * cells_);
      best_ = {};
      std::vector<Plan> plans;
      for (std::uint32_t v = 0; v < 2 * kRules; ++v) {
        plans.push_back(first_plan(sheet, v % 2 == 0));
        plans.back().rule = v / 2;
      }
      choose(sheet, plans, 2 * cells_);
      if (!best_.whole) {
        if (found.cells != 0) break;
        share *= 0.5;
        continue;
      }
      ++count;
      const double filled = 1.0 * cells_ / best_.height;
      found = std::move(sheet);
      packed = best_;
      plan = plan_;
      if (filled > 1 - tolerance && filled < 1 + tolerance) break;
      share *= std::clamp(filled, 0.5, 1.2);
    }
    best_ = std::move(packed);
    plan_ = std::move(plan);
    return found;
  }

  /// Packs all and keeps the best, of equals the first. \returns whether one was kept
  bool choose(const Sheet& sheet, std::span<const Plan> plans, std::uint32_t rows) {
    std::vector<Packed> results(plans.size());
    const std::uint32_t most = best_.whole ? std::min(rows, best_.height) : rows;
    const auto body = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) results[i] = pack(sheet, plans[i], most);
    };
    parallel_for(plans.size(), 1, body, threads_);
    bool any = false;
    for (std::size_t i = 0; i < plans.size(); ++i) {
      if (!results[i].whole) continue;
      if (best_.whole &&
          std::tie(results[i].height, results[i].weight) >= std::tie(best_.height, best_.weight)) {
        continue;
      }
      best_ = std::move(results[i]);
      plan_ = plans[i];
      any = true;
    }
    return any;
  }

  /// Changes the order a little, again and again. What has become lower is drawn larger.
  void improve(Sheet& sheet) {
    const auto count = static_cast<std::uint32_t>(outlines_.size());
    std::mt19937 random(1);
    const std::uint32_t batches =
        std::clamp(kSearchEffort / (count * count), kLeastBatches, kMostBatches);
    for (std::uint32_t i = 0; i < batches; ++i) {
      std::array<Plan, kBatch> plans;
      for (Plan& plan : plans) plan = changed(random);
      const bool better = choose(sheet, plans, 2 * sheet.cells);
      if (better && best_.height < (1 - kFlatShare) * sheet.cells) enlarge(sheet);
    }
    while (best_.height < (1 - kFlatShare) * sheet.cells && enlarge(sheet)) {
    }
  }

  /// Draws all larger by what is left above, or less of it. \returns whether they still fit
  bool enlarge(Sheet& sheet) {
    const Packed before = std::move(best_);
    const Plan plan = plan_;
    for (const double share : {1.0, 0.5, 0.2}) {
      const double room = std::sqrt(static_cast<double>(sheet.cells) / before.height);
      const double growth = 1 + share * (room - 1);
      Sheet larger = draw(sheet.cells, sheet.scale * growth);
      std::vector<Plan> plans(2 + kRules, plan);
      plans[1] = near(before, sheet.cells);
      for (std::uint32_t rule = 0; rule < kRules; ++rule) {
        plans[2 + rule].rule = rule;
        plans[2 + rule].turn.assign(outlines_.size(), -1);
      }
      best_ = {};
      choose(larger, plans, sheet.cells);
      plan_.left.clear();
      if (best_.whole) {
        sheet = std::move(larger);
        return true;
      }
    }
    best_ = before;
    plan_ = plan;
    return false;
  }

  /// From the bottom up, each close to where it was.
  Plan near(const Packed& packed, std::uint32_t cells) const {
    Plan plan = plan_;
    plan.turn = packed.turn;
    for (const std::uint32_t x : packed.x) plan.left.push_back(static_cast<double>(x) / cells);
    std::stable_sort(plan.order.begin(), plan.order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return packed.y[a] < packed.y[b]; });
    return plan;
  }

  Plan changed(std::mt19937& random) const {
    Plan plan = plan_;
    const auto count = static_cast<std::uint32_t>(outlines_.size());
    const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
    const std::uint32_t kind = below(8);
    if (kind < 3) {  // What reaches farthest up goes earlier.
      const auto at = std::find(plan.order.begin(), plan.order.end(), best_.top);
      const auto place = static_cast<std::uint32_t>(at - plan.order.begin());
      std::rotate(plan.order.begin() + below(place + 1), at, at + 1);
      plan.turn[best_.top] = -1;
    } else if (kind < 5) {
      const std::uint32_t a = below(count), b = std::min(count - 1, a + 1 + below(4));
      std::swap(plan.order[a], plan.order[b]);
    } else if (kind < 7) {  // Among the largest, another turn.
      const std::uint32_t i = plan.order[below(std::min(count, 16U))];
      const std::uint32_t step = turns_ / turns_of_[i];
      plan.turn[i] = static_cast<std::int8_t>(below(turns_of_[i]) * step);
    } else {
      plan.rule = below(kRules);
      const std::uint32_t a = below(count), b = below(count);
      std::swap(plan.order[a], plan.order[b]);
    }
    return plan;
  }

  /// The same order with finer cells, as large as it fits the square.
  OutlinePacking finish(const Sheet& sheet) {
    const std::uint32_t cells = std::min(size_, kFinalCells);
    Plan plan = plan_;
    if (cells > sheet.cells) plan.turn = best_.turn;
    const double filled = static_cast<double>(best_.height) / sheet.cells;
    const double base = sheet.scale / sheet.cells / (filled > 1 ? filled : std::sqrt(filled));
    OutlinePacking packing;
    if (best_.height <= sheet.cells) packing = {sheet.scale * size_ / sheet.cells, best_.places};
    const double least = packing.scale / size_;
    // Larger and larger steps down, so that there is always an end.
    const Plan close = cells > sheet.cells ? near(best_, sheet.cells) : plan;
    double step = 0.0025, factor = 1.02;
    for (int round = 0; round < 400 && base * factor > least; ++round) {
      std::array<Packed, 2> results;
      std::array<double, 2> scales{};
      for (double& scale : scales) {
        scale = base * factor * cells;
        factor -= step;
        if (round > 4) step = std::min(0.05 * factor, step * 1.3);
      }
      const auto body = [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Sheet fine = draw(cells, scales[i], plan.turn);
          results[i] = pack(fine, close, cells);
          if (!results[i].whole) results[i] = pack(fine, plan, cells);
        }
      };
      parallel_for(results.size(), 1, body, threads_);
      for (std::size_t i = 0; i < results.size(); ++i) {
        if (!results[i].whole || scales[i] <= least * cells) continue;
        packing.scale = scales[i] * size_ / cells;
        packing.places = std::move(results[i].places);
        return packing;
      }
    }
    return packing;
  }

  std::span<const Outline> outlines_;
  int threads_;
  std::uint32_t size_, cells_;
  double padding_, area_ = 0;
  std::uint32_t turns_;
  std::vector<double> angles_;
  std::vector<std::uint32_t> turns_of_;
  Plan plan_;
  Packed best_;
};

}  // namespace

double expected_share(std::span<const Outline> outlines, std::uint32_t size, double padding,
                      double tolerance) {
  return Packer(outlines, size, padding, kEstimateCells, 1).expected(tolerance);
}

OutlinePacking pack_outlines(std::span<const Outline> outlines, std::uint32_t size, double padding,
                             int threads) {
  return Packer(outlines, size, padding, kSearchCells, threads).run();
}

}  // namespace kiln
