// Priority queue of edges to collapse.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kiln {

/// A collapse that waits.
struct CollapseEntry {
  double cost;
  std::uint32_t a, b;  ///< a < b
  std::uint32_t stamp_a, stamp_b;
  std::uint32_t leniency;  ///< Times it was refused for the shapes it would leave.
  bool operator<(const CollapseEntry& other) const;  ///< Dearer first out last, as std heaps want.
};

/// Gives entries in order of cost, ties to the lower vertices. Only the cheapest are in order; the others wait in a
/// list. From time to time the next cheapest of it are taken. What is pushed among the cheapest meanwhile is in a heap.
class CollapseQueue {
 public:
  /// Takes the place of all there was.
  void assign(std::vector<CollapseEntry>&& entries);
  void push(const CollapseEntry& entry);
  void pop();
  /// \param stamps  by vertex: entries of another time are dropped on the way
  /// \returns the cheapest; null where there is none
  const CollapseEntry* front(const std::vector<std::uint32_t>& stamps) {
    if (sorted_.empty() && late_.empty() && !far_.empty()) take_nearest(stamps);
    if (late_.empty()) return sorted_.empty() ? nullptr : &sorted_.back();
    return is_late_first() ? &late_.front() : &sorted_.back();
  }
  /// One that will be the cheapest after so many others, or more; null where that is not known.
  const CollapseEntry* ahead(std::size_t others) const {
    return others < sorted_.size() ? &sorted_[sorted_.size() - 1 - others] : nullptr;
  }
  /// Follows vertices to new numbers, which are in the same order. What is of another time is dropped.
  /// \param number  by vertex; kNoVertex: it is gone
  /// \param stamps  by old number
  void renumber(const std::vector<std::uint32_t>& number, const std::vector<std::uint32_t>& stamps);

 private:
  void take_nearest(const std::vector<std::uint32_t>& stamps);
  bool is_late_first() const { return sorted_.empty() || sorted_.back() < late_.front(); }

  std::vector<CollapseEntry> sorted_;  ///< Entries up to `limit_`, the cheapest last.
  std::vector<CollapseEntry> late_;    ///< A heap of those that came later.
  std::vector<CollapseEntry> far_;
  std::vector<double> costs_;
  double limit_ = 0;
};

}  // namespace kiln
