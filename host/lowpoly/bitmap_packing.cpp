#include "lowpoly/bitmap_packing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <tuple>

#include "base/heartbeat.h"
#include "base/parallel.h"

namespace kiln {
namespace {

constexpr std::uint32_t most_cells = 512;

/// What is taken of the square, and of its rows all widenings to the left by a power of two.
class Taken {
 public:
  explicit Taken(std::uint32_t side)
      : side_(side), words_((side + 63) / 64), levels_(std::bit_width(side)) {
    bits_.assign(std::size_t{levels_} * side * words_, 0);
    blocked_.resize(words_);
  }

  /// The lowest row, and in it the first cell, where the mask is free; with its top below `limit`.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> find(const ChartMask& mask,
                                                              std::uint32_t limit) {
    if (mask.width > side_ || mask.height > side_) return std::nullopt;
    for (std::uint32_t y = 0; y + mask.height <= std::min(side_, limit - 1); ++y) {
      if (const auto x = first_free(mask, y)) return std::pair{*x, y};
    }
    return std::nullopt;
  }

  void take(const ChartMask& mask, std::uint32_t x, std::uint32_t y) {
    for (const ChartMask::Run& run : mask.runs) {
      std::uint64_t* const row = level(0, y + run.row);
      for (std::uint32_t i = x + run.first; i <= x + run.last; ++i) {
        row[i / 64] |= std::uint64_t{1} << i % 64;
      }
    }
    for (std::uint32_t k = 1; k < levels_; ++k) {
      for (std::uint32_t row = y; row < y + mask.height; ++row) {
        std::uint64_t* const wide = level(k, row);
        const std::uint64_t* const narrow = level(k - 1, row);
        std::copy(narrow, narrow + words_, wide);
        merge(narrow, 1U << (k - 1), wide);
      }
    }
  }

 private:
  std::uint64_t* level(std::uint32_t k, std::uint32_t row) {
    return bits_.data() + (std::size_t{k} * side_ + row) * words_;
  }

  /// target |= source moved down by `shift` bits.
  void merge(const std::uint64_t* source, std::uint32_t shift, std::uint64_t* target) const {
    const std::uint32_t whole = shift / 64, part = shift % 64;
    for (std::uint32_t w = 0; w + whole < words_; ++w) {
      std::uint64_t value = source[w + whole] >> part;
      if (part != 0 && w + whole + 1 < words_) value |= source[w + whole + 1] << (64 - part);
      target[w] |= value;
    }
  }

  std::optional<std::uint32_t> first_free(const ChartMask& mask, std::uint32_t y) {
    const std::uint32_t places = side_ - mask.width + 1;
    for (std::uint32_t w = 0; w < words_; ++w) {
      const std::uint32_t from = w * 64;
      blocked_[w] = places >= from + 64 ? 0
                    : places <= from    ? ~std::uint64_t{0}
                                        : ~std::uint64_t{0} << (places - from);
    }
    for (const ChartMask::Run& run : mask.runs) {
      const std::uint32_t count = run.last - run.first + 1;
      const auto k = static_cast<std::uint32_t>(std::bit_width(count)) - 1;
      const std::uint64_t* const row = level(k, y + run.row);
      merge(row, run.first, blocked_.data());
      merge(row, run.last + 1 - (1U << k), blocked_.data());
      if (std::all_of(blocked_.begin(), blocked_.end(),
                      [](auto w) { return w == ~std::uint64_t{0}; })) {
        return std::nullopt;
      }
    }
    for (std::uint32_t w = 0; w < words_; ++w) {
      if (blocked_[w] != ~std::uint64_t{0}) {
        return w * 64 + static_cast<std::uint32_t>(std::countr_one(blocked_[w]));
      }
    }
    return std::nullopt;
  }

  std::uint32_t side_, words_, levels_;
  std::vector<std::uint64_t> bits_, blocked_;
};

class Packer {
 public:
  Packer(std::span<const Outline> outlines, std::uint32_t size, double padding, int threads)
      : outlines_(outlines), threads_(threads), side_(std::min(size, most_cells)) {
    cell_ = static_cast<double>(size) / side_;
    margin_ = 0.5 * padding / cell_;
    for (const Outline& outline : outlines) {
      area_ += outline.area;
      angles_.push_back(best_box_angle(outline));
    }
    // Large outlines decide; small ones find gaps at few turns.
    turns_ = outlines.size() <= 12 ? 16 : outlines.size() <= 24 ? 8 : 4;
  }

  OutlinePacking search() {
    OutlinePacking best;
    double low = 0, high = 1;  // Share of the square that the outlines fill.
    double share = 0.75;
    while (high - low > (low > 0.25 ? 0.004 : 0.05 * high)) {
      OutlinePacking packing = attempt(std::sqrt(share * side_ * side_ / area_));
      if (packing.scale > 0) {
        low = share;
        best = std::move(packing);
        share = std::min(0.5 * (low + high), low + 0.04);
      } else {
        high = share;
        if (high < 1e-6) return best;
        share = low > 0 ? 0.5 * (low + high) : 0.7 * high;
      }
    }
    return best;
  }

 private:
  /// The orders and rules that are tried at every scale.
  static constexpr std::uint32_t variants = 6;
  /// How often an order is mended.
  static constexpr int rounds = 4;

  OutlinePacking attempt(double scale) {
    const std::size_t count = outlines_.size();
    masks_.assign(count * turns_, {});
    const auto draw = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const double turn = static_cast<double>(i % turns_) * 2 * std::numbers::pi / turns_;
        masks_[i] = make_mask(outlines_[i / turns_], angles_[i / turns_] + turn, scale, margin_);
      }
    };
    parallel_for(masks_.size(), 1, draw, threads_);
    std::vector<OutlinePacking> packings(variants);
    std::atomic<std::uint32_t> found{variants};
    const auto try_variants = [&](std::size_t begin, std::size_t end) {
      for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
        if (found < v) continue;  // Only the first that fits counts.
        if (!pack(v, packings[v])) continue;
        packings[v].scale = scale * cell_;
        std::uint32_t known = found;
        while (v < known && !found.compare_exchange_weak(known, v)) {
        }
      }
    };
    parallel_for(variants, 1, try_variants, threads_);
    return found < variants ? std::move(packings[found]) : OutlinePacking{};
  }

  std::vector<std::uint32_t> order(std::uint32_t variant) const {
    std::vector<std::tuple<double, std::uint32_t>> keys;
    for (std::uint32_t i = 0; i < outlines_.size(); ++i) {
      const ChartMask& mask = masks_[std::size_t{i} * turns_];
      const auto box = static_cast<double>(std::max(mask.width, mask.height));
      const double key = variant / 2 == 0   ? outlines_[i].area
                         : variant / 2 == 1 ? box
                                            : box * std::sqrt(outlines_[i].area);
      keys.emplace_back(-key, i);
    }
    std::sort(keys.begin(), keys.end());
    std::vector<std::uint32_t> result;
    for (const auto& [key, i] : keys) result.push_back(i);
    return result;
  }

  /// Whoever finds no place comes earlier in the next round.
  bool pack(std::uint32_t variant, OutlinePacking& packing) const {
    std::vector<std::uint32_t> turn = order(variant);
    for (int round = 0; round < rounds; ++round) {
      const std::size_t failed = pack_in(turn, variant, packing);
      if (failed == turn.size()) return true;
      const auto at = turn.begin() + static_cast<std::ptrdiff_t>(failed);
      std::rotate(turn.begin() + static_cast<std::ptrdiff_t>(failed / 2), at, at + 1);
    }
    return false;
  }

  /// \returns the place in the order of the first that finds none; how many there are: all do
  std::size_t pack_in(std::span<const std::uint32_t> sequence, std::uint32_t variant,
                      OutlinePacking& packing) const {
    packing.places.assign(outlines_.size(), {});
    Taken taken(side_);
    for (std::size_t n = 0; n < sequence.size(); ++n) {
      Heartbeat::beat();
      const std::uint32_t i = sequence[n];
      const ChartMask* chosen = nullptr;
      std::uint32_t best = side_ + 1, x = 0, y = 0;
      for (std::uint32_t turn = 0; turn < turns_; ++turn) {
        const ChartMask& mask = masks_[std::size_t{i} * turns_ + turn];
        const auto at = taken.find(mask, best + 1 - (variant % 2));
        if (!at) continue;
        if (at->second + mask.height < best || chosen == nullptr || at->first < x) {
          best = at->second + mask.height;
          x = at->first, y = at->second;
          chosen = &mask;
        }
      }
      if (chosen == nullptr) return n;
      taken.take(*chosen, x, y);
      packing.places[i] = {chosen->turn,
                           {(x + chosen->shift.x) * cell_, (y + chosen->shift.y) * cell_}};
    }
    return sequence.size();
  }

  std::span<const Outline> outlines_;
  int threads_;
  std::uint32_t side_, turns_ = 8;
  double cell_ = 1, margin_ = 0, area_ = 0;
  std::vector<double> angles_;
  std::vector<ChartMask> masks_;
};

}  // namespace

OutlinePacking pack_outlines(std::span<const Outline> outlines, std::uint32_t size, double padding,
                             int threads) {
  return Packer(outlines, size, padding, threads).search();
}

}  // namespace kiln
