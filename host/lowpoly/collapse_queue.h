// Which edge collapses next.
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
  std::uint32_t leniency;  ///< How often it was refused for the shapes it would leave.
  bool operator<(const CollapseEntry& other) const;  ///< Dearer first out last, as std heaps want.
};

/// Gives entries in order of cost, ties to the lower vertices. Only the cheapest are in a heap, which so stays in the
/// cache; the others wait in a list. From time to time the next cheapest of it are taken.
class CollapseQueue {
 public:
  /// Takes the place of all there was.
  void assign(std::vector<CollapseEntry>&& entries);
  void push(const CollapseEntry& entry);
  void pop();
  /// \param stamps  by vertex: entries of another time are dropped on the way
  /// \returns the cheapest; null where there is none
  const CollapseEntry* front(const std::vector<std::uint32_t>& stamps) {
    if (near_.empty() && !far_.empty()) take_nearest(stamps);
    return near_.empty() ? nullptr : &near_.front();
  }

 private:
  void take_nearest(const std::vector<std::uint32_t>& stamps);

  std::vector<CollapseEntry> near_;  ///< A heap of those up to `limit_`.
  std::vector<CollapseEntry> far_;
  std::vector<double> costs_;
  double limit_ = 0;
};

}  // namespace kiln
