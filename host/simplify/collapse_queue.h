// Priority queue of edges to collapse.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kiln {

/// An edge in the queue, with the cost of its collapse.
struct CollapseEntry {
  double cost;
  std::uint32_t a, b;  ///< Vertices of the edge, a < b
  std::uint32_t stamp_a, stamp_b;
  /// Number of times that the collapse was rejected for bad shapes. Each rejection relaxes the limits of shapes
  std::uint32_t leniency;
  /// Compares by descending cost, because heaps of the standard library keep the largest element first.
  bool operator<(const CollapseEntry& other) const;
};

/// A priority queue of edges by cost. Among equal costs, the edge with the lower vertices comes first. Only the
/// cheapest entries are sorted. The others are in an unsorted list, from which the next cheapest are taken when the
/// sorted entries run out. New entries that are cheaper than the whole unsorted list go to a small heap.
class CollapseQueue {
 public:
  /// Replaces the contents of the queue.
  void assign(std::vector<CollapseEntry>&& entries);
  void push(const CollapseEntry& entry);
  void pop();
  /// \param stamps  current stamp of each vertex; entries with an older stamp are removed
  /// \returns the cheapest entry; null if the queue is empty
  const CollapseEntry* front(const std::vector<std::uint32_t>& stamps) {
    if (sorted_entries_.empty() && added_heap_.empty() && !unsorted_entries_.empty())
      sort_next_batch(stamps);
    if (added_heap_.empty()) return sorted_entries_.empty() ? nullptr : &sorted_entries_.back();
    return is_added_first() ? &added_heap_.front() : &sorted_entries_.back();
  }
  /// An entry that will become the cheapest one after at least `others` pops, for prefetching; null if no such entry is
  /// known.
  const CollapseEntry* peek(std::size_t others) const {
    return others < sorted_entries_.size() ? &sorted_entries_[sorted_entries_.size() - 1 - others]
                                           : nullptr;
  }
  /// Renumbers the vertices of all entries; vertices must keep their order. Removes outdated entries.
  /// \param number  new index of each vertex; kNoVertex for removed ones
  /// \param stamps  stamp of each vertex, by its old index
  void renumber(const std::vector<std::uint32_t>& number, const std::vector<std::uint32_t>& stamps);

 private:
  void sort_next_batch(const std::vector<std::uint32_t>& stamps);
  bool is_added_first() const {
    return sorted_entries_.empty() || sorted_entries_.back() < added_heap_.front();
  }

  std::vector<CollapseEntry>
      sorted_entries_;  ///< Entries with costs up to `sorted_cost_limit_`, the cheapest last
  std::vector<CollapseEntry> added_heap_;  ///< Heap of the entries that were added after sorting
  std::vector<CollapseEntry> unsorted_entries_;
  std::vector<double> sampled_costs_;
  double sorted_cost_limit_ = 0;
};

}  // namespace kiln
