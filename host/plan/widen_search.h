// Search distance for simplified low polys, whose deviation may exceed the default distance of bakes.
#pragma once

#include <utility>

#include "kiln/bake.h"

namespace kiln {

/// Runs an attempt, and repeats it with doubled search distances while over 0.5% of the samples miss, up to eight
/// times kSearchDistance, and as long as each doubling resolves at least a quarter of the misses. A search distance
/// or cage that the caller has set is not changed.
/// \param options  receives the chosen distance if it differs from the default
/// \param attempt  function from options to a result
/// \param missed_share  function from a result to the share of samples without a point
template <class Attempt, class Missed>
auto widen_search(BakeOptions& options, const Attempt& attempt, const Missed& missed_share) {
  constexpr double kMaxMissedShare = 0.005, kMaxUnresolvedShare = 0.75,
                   kFirstDistanceShare = 2 * kSearchDistance,
                   kMaxDistanceShare = 8 * kSearchDistance;
  auto result = attempt(options);
  if (options.match.max_distance || options.match.cage || options.match.cage_mesh != nullptr)
    return result;
  for (double share = kFirstDistanceShare;
       share <= kMaxDistanceShare && missed_share(result) > kMaxMissedShare; share *= 2) {
    BakeOptions wider_options = options;
    wider_options.match.max_distance = Length::share(share);
    auto next_result = attempt(wider_options);
    if (missed_share(next_result) > kMaxUnresolvedShare * missed_share(result)) break;
    result = std::move(next_result);
    options.match.max_distance = wider_options.match.max_distance;
  }
  return result;
}

}  // namespace kiln
