#include "simplify/collapse_queue.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace kiln {
namespace {

/// Edges sorted at a time: at least kMinBatch, and one in kBatchDivisor.
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
  late_.clear();
  far_ = std::move(entries);
  limit_ = -std::numeric_limits<double>::infinity();
}

void CollapseQueue::push(const CollapseEntry& entry) {
  if (entry.cost > limit_) {
    far_.push_back(entry);
    return;
  }
  late_.push_back(entry);
  std::push_heap(late_.begin(), late_.end());
}

void CollapseQueue::pop() {
  if (late_.empty() || !is_late_first()) {
    sorted_.pop_back();
    return;
  }
  std::pop_heap(late_.begin(), late_.end());
  late_.pop_back();
}

void CollapseQueue::renumber(const std::vector<std::uint32_t>& number,
                             const std::vector<std::uint32_t>& stamps) {
  for (std::vector<CollapseEntry>* entries : {&sorted_, &late_, &far_}) {
    erase_old(*entries, stamps);
    for (CollapseEntry& e : *entries) e.a = number[e.a], e.b = number[e.b];
  }
  std::make_heap(late_.begin(), late_.end());
}

void CollapseQueue::sort_next_batch(const std::vector<std::uint32_t>& stamps) {
  erase_old(far_, stamps);
  if (far_.empty()) return;
  limit_ = std::numeric_limits<double>::infinity();
  if (const std::size_t taken = std::max(kMinBatch, far_.size() / kBatchDivisor);
      taken < far_.size()) {
    costs_.clear();
    const std::size_t step = (far_.size() + kCostSamples - 1) / kCostSamples;
    for (std::size_t i = 0; i < far_.size(); i += step) costs_.push_back(far_[i].cost);
    const auto last = costs_.begin() + static_cast<std::ptrdiff_t>(taken / step);
    std::nth_element(costs_.begin(), last, costs_.end());
    limit_ = *last;
  }
  const auto dearer = std::partition(far_.begin(), far_.end(),
                                     [&](const CollapseEntry& e) { return e.cost > limit_; });
  sorted_.assign(dearer, far_.end());
  far_.erase(dearer, far_.end());
  std::sort(sorted_.begin(), sorted_.end());
}

}  // namespace kiln
