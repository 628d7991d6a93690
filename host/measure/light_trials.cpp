#include "measure/light_trials.h"

#include <algorithm>

#include "measure/light_limits.h"

namespace kiln {

using namespace light_limits;

LightMisses LightMisses::of(std::span<const LightTrial> trials, std::uint32_t size, double wanted) {
  LightMisses misses;
  for (const LightTrial& trial : trials) {
    if (trial.size != size || trial.measured <= wanted) continue;
    const auto bytes = static_cast<double>(trial.bytes.total());
    misses.heaviest = std::max(misses.heaviest, bytes);
    misses.nearest = misses.count == 0 ? trial.measured : std::min(misses.nearest, trial.measured);
    ++misses.count;
  }
  return misses;
}

double LightMisses::aim(double wanted) const {
  return wanted * (1 - kCare * static_cast<double>(count));
}

double LightMisses::next_bytes(double best) const {
  const double finer = heaviest * (1 + kFiner * static_cast<double>(std::min(count, kFinerMisses)));
  return std::min(finer, (heaviest + best) / 2);
}

double LightMisses::price() const { return 1 + kMissPrice * static_cast<double>(count); }

bool LightMisses::nearly(double wanted) const { return count > 0 && nearest <= kNearly * wanted; }

bool is_better(const LightTrial& next, const LightTrial& best, double wanted) {
  const bool best_reaches = best.measured <= wanted;
  if (next.measured <= wanted) return !best_reaches || next.bytes.total() < best.bytes.total();
  return !best_reaches && next.measured < best.measured;
}

void correct(std::span<LightTrial> trials, const LightTrial& measured) {
  for (LightTrial& trial : trials) {
    if (trial.faces == measured.faces && trial.size == measured.size) trial = measured;
  }
}

bool was_tried(std::span<const LightTrial> trials, std::uint64_t faces, std::uint32_t size) {
  return std::any_of(trials.begin(), trials.end(), [&](const LightTrial& trial) {
    return trial.faces == faces && trial.size == size;
  });
}

bool tried_about(std::span<const LightTrial> trials, std::uint64_t faces, std::uint32_t size) {
  return std::any_of(trials.begin(), trials.end(), [&](const LightTrial& trial) {
    const double ratio = static_cast<double>(trial.faces) / static_cast<double>(faces);
    return trial.size == size && ratio < kOtherFaces && ratio > 1 / kOtherFaces;
  });
}

}  // namespace kiln
