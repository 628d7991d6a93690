#include "simplify/collapse_queue.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace kiln {
namespace {

/// Number of entries that are sorted at a time: the queue's size divided by kBatchDivisor, but at least kMinBatch.
constexpr std::size_t kMinBatch = 1024, kBatchDivisor = 16;
/// Number of costs that are sampled to estimate the cost limit of the next batch.
constexpr std::size_t kCostSamples = 4096;

void erase_outdated(std::vector<CollapseEntry>& entries, const std::vector<std::uint32_t>& stamps) {
  std::erase_if(entries, [&](const CollapseEntry& e) {
    return e.stamp_a != stamps[e.a] || e.stamp_b != stamps[e.b];
  });
}

}  // namespace

bool CollapseEntry::operator<(const CollapseEntry& o) const {
  return cost != o.cost ? cost > o.cost : std::tie(a, b) > std::tie(o.a, o.b);
}

void CollapseQueue::assign(std::vector<CollapseEntry>&& entries) {
  sorted_entries_.clear();
  added_heap_.clear();
  unsorted_entries_ = std::move(entries);
  sorted_cost_limit_ = -std::numeric_limits<double>::infinity();
}

void CollapseQueue::push(const CollapseEntry& entry) {
  if (entry.cost > sorted_cost_limit_) {
    unsorted_entries_.push_back(entry);
    return;
  }
  added_heap_.push_back(entry);
  std::push_heap(added_heap_.begin(), added_heap_.end());
}

void CollapseQueue::pop() {
  if (added_heap_.empty() || !is_added_first()) {
    sorted_entries_.pop_back();
    return;
  }
  std::pop_heap(added_heap_.begin(), added_heap_.end());
  added_heap_.pop_back();
}

void CollapseQueue::renumber(const std::vector<std::uint32_t>& number,
                             const std::vector<std::uint32_t>& stamps) {
  for (std::vector<CollapseEntry>* entries : {&sorted_entries_, &added_heap_, &unsorted_entries_}) {
    erase_outdated(*entries, stamps);
    for (CollapseEntry& e : *entries) e.a = number[e.a], e.b = number[e.b];
  }
  std::make_heap(added_heap_.begin(), added_heap_.end());
}

void CollapseQueue::sort_next_batch(const std::vector<std::uint32_t>& stamps) {
  erase_outdated(unsorted_entries_, stamps);
  if (unsorted_entries_.empty()) return;
  sorted_cost_limit_ = std::numeric_limits<double>::infinity();
  if (const std::size_t batch_size = std::max(kMinBatch, unsorted_entries_.size() / kBatchDivisor);
      batch_size < unsorted_entries_.size()) {
    sampled_costs_.clear();
    const std::size_t step = (unsorted_entries_.size() + kCostSamples - 1) / kCostSamples;
    for (std::size_t i = 0; i < unsorted_entries_.size(); i += step)
      sampled_costs_.push_back(unsorted_entries_[i].cost);
    const auto last = sampled_costs_.begin() + static_cast<std::ptrdiff_t>(batch_size / step);
    std::nth_element(sampled_costs_.begin(), last, sampled_costs_.end());
    sorted_cost_limit_ = *last;
  }
  const auto first_expensive =
      std::partition(unsorted_entries_.begin(), unsorted_entries_.end(),
                     [&](const CollapseEntry& e) { return e.cost > sorted_cost_limit_; });
  sorted_entries_.assign(first_expensive, unsorted_entries_.end());
  unsorted_entries_.erase(first_expensive, unsorted_entries_.end());
  std::sort(sorted_entries_.begin(), sorted_entries_.end());
}

}  // namespace kiln
