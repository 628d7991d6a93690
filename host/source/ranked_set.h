// A set of triangles or vertices of a large mesh, a bit for each.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/parallel.h"

namespace kiln {

/// A set of integers that finds the rank of each member, that is, its index in ascending order.
class RankedSet {
 public:
  explicit RankedSet(std::size_t size) : words_(size / 64 + 1), members_before_(words_.size()) {}

  void add(std::uint32_t i) { words_[i / 64] |= std::uint64_t{1} << (i % 64); }
  /// Variant of add() that several threads may call at the same time.
  void add_concurrently(std::uint32_t i) {
    std::atomic_ref<std::uint64_t>(words_[i / 64])
        .fetch_or(std::uint64_t{1} << (i % 64), std::memory_order_relaxed);
  }
  /// Prepares rank_of(). \returns the members, ascending
  std::vector<std::uint32_t> list() {
    std::uint32_t count = 0;
    for (std::size_t w = 0; w < words_.size(); ++w) {
      members_before_[w] = count;
      count += static_cast<std::uint32_t>(std::popcount(words_[w]));
    }
    std::vector<std::uint32_t> ascending_members(count);
    parallel_for(words_.size(), kWordsPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t w = begin; w < end; ++w) {
        std::size_t at = members_before_[w];
        for (std::uint64_t left = words_[w]; left != 0; left &= left - 1) {
          ascending_members[at++] =
              static_cast<std::uint32_t>(w * 64 + static_cast<std::size_t>(std::countr_zero(left)));
        }
      }
    });
    return ascending_members;
  }
  std::uint32_t rank_of(std::uint32_t i) const {
    const std::uint64_t lower = (std::uint64_t{1} << (i % 64)) - 1;
    return members_before_[i / 64] +
           static_cast<std::uint32_t>(std::popcount(words_[i / 64] & lower));
  }

 private:
  static constexpr std::size_t kWordsPerTask = std::size_t{1} << 15;

  std::vector<std::uint64_t> words_;
  std::vector<std::uint32_t> members_before_;
};

}  // namespace kiln
