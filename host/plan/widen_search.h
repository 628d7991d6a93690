// Search distance for simplified low polys, whose deviation may exceed the default distance of bakes.
#pragma once

#include <utility>

#include "kiln/bake.h"

namespace kiln {

/// Runs an attempt. While over 0.5% of the samples miss, doubles the search distance, up to eight times
/// kSearchDistance, as long as each doubling resolves at least a quarter of the misses. An explicit distance or cage is
/// kept.
/// \param options  receives the chosen distance if it differs from the default
/// \param attempt  function from options to a result
/// \param missed  function from a result to the share of samples without a point
template <class Attempt, class Missed>
auto widen_search(BakeOptions& options, const Attempt& attempt, const Missed& missed) {
  constexpr double kMaxMissedShare = 0.005, kMaxUnresolvedShare = 0.75,
                   kFirstDistanceShare = 2 * kSearchDistance,
                   kMaxDistanceShare = 8 * kSearchDistance;
  auto result = attempt(options);
  if (options.match.max_distance || options.match.cage || options.match.cage_mesh != nullptr)
    return result;
  for (double share = kFirstDistanceShare;
       share <= kMaxDistanceShare && missed(result) > kMaxMissedShare; share *= 2) {
    BakeOptions wide = options;
    wide.match.max_distance = Length::share(share);
    auto next = attempt(wide);
    if (missed(next) > kMaxUnresolvedShare * missed(result)) break;
    result = std::move(next);
    options.match.max_distance = wide.match.max_distance;
  }
  return result;
}

}  // namespace kiln
