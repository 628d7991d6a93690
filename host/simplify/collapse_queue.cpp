#include "simplify/collapse_queue.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace kiln {
namespace {

/// Number of entries sorted at a time: 1/kBatchDivisor of the queue, but at least kMinBatch.
constexpr std::size_t kMinBatch = 1024, kBatchDivisor = 16;
/// Number of costs sampled to estimate the limit of the next batch.
constexpr std::size_t kCostSamples = 4096;

void erase_old(std::vector<CollapseEntry>& entries, const std::vector<std::uint32_t>& stamps) {
  std::erase_if(entries, [&](const CollapseEntry& e) {
    return e.stamp_a != stamps[e.a] || e.stamp_b != stamps[e.b];
  });
}

}  // namespace

bool CollapseEntry::operator<(const CollapseEntry& o) const {
  return cost != o.cost ? cost > o.cost : std::tie(a, b) > std::tie(o.a, o.b);
}

void CollapseQueue::assign(std::vector<CollapseEntry>&& entries) {
  sorted_.clear();
  added_.clear();
  unsorted_ = std::move(entries);
  limit_ = -std::numeric_limits<double>::infinity();
}

void CollapseQueue::push(const CollapseEntry& entry) {
  if (entry.cost > limit_) {
    unsorted_.push_back(entry);
    return;
  }
  added_.push_back(entry);
  std::push_heap(added_.begin(), added_.end());
}

void CollapseQueue::pop() {
  if (added_.empty() || !is_added_first()) {
    sorted_.pop_back();
    return;
  }
  std::pop_heap(added_.begin(), added_.end());
  added_.pop_back();
}

void CollapseQueue::renumber(const std::vector<std::uint32_t>& number,
                             const std::vector<std::uint32_t>& stamps) {
  for (std::vector<CollapseEntry>* entries : {&sorted_, &added_, &unsorted_}) {
    erase_old(*entries, stamps);
    for (CollapseEntry& e : *entries) e.a = number[e.a], e.b = number[e.b];
  }
  std::make_heap(added_.begin(), added_.end());
}

void CollapseQueue::sort_next_batch(const std::vector<std::uint32_t>& stamps) {
  erase_old(unsorted_, stamps);
  if (unsorted_.empty()) return;
  limit_ = std::numeric_limits<double>::infinity();
  if (const std::size_t taken = std::max(kMinBatch, unsorted_.size() / kBatchDivisor);
      taken < unsorted_.size()) {
    costs_.clear();
    const std::size_t step = (unsorted_.size() + kCostSamples - 1) / kCostSamples;
    for (std::size_t i = 0; i < unsorted_.size(); i += step) costs_.push_back(unsorted_[i].cost);
    const auto last = costs_.begin() + static_cast<std::ptrdiff_t>(taken / step);
    std::nth_element(costs_.begin(), last, costs_.end());
    limit_ = *last;
  }
  const auto dearer = std::partition(unsorted_.begin(), unsorted_.end(),
                                     [&](const CollapseEntry& e) { return e.cost > limit_; });
  sorted_.assign(dearer, unsorted_.end());
  unsorted_.erase(dearer, unsorted_.end());
  std::sort(sorted_.begin(), sorted_.end());
}

}  // namespace kiln
