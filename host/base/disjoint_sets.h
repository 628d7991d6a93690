// Union-find.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace kiln {

/// Disjoint-set forest. The lowest member represents a set, so the result does not depend on the order of joins.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_of_item_(count) {
    std::iota(parent_of_item_.begin(), parent_of_item_.end(), 0U);
  }
  std::uint32_t find(std::uint32_t item) {
    while (parent_of_item_[item] != item)
      item = parent_of_item_[item] = parent_of_item_[parent_of_item_[item]];
    return item;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_of_item_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_of_item_;
};

}  // namespace kiln
