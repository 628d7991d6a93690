// Search distance from low polys that were made here: they may stray farther than bakes search.
#pragma once

#include <utility>

#include "kiln/bake.h"

namespace kiln {

/// A try. Where over 0.5% is missed, further ones search twice as far each, up to eight times kSearchDistance, as long as a
/// quarter of what was missed is found. A distance or a cage that was asked for stays.
/// \param options  get the distance that was taken, where another than that of bakes was
/// \param attempt  makes a result of options
/// \param missed   share of its samples without a point
template <class Attempt, class Missed>
auto widen_search(BakeOptions& options, const Attempt& attempt, const Missed& missed) {
  constexpr double kFewMissed = 0.005, kMostLeft = 0.75, kFirstShare = 2 * kSearchDistance,
                   kFarthestShare = 8 * kSearchDistance;
  auto result = attempt(options);
  if (options.match.max_distance || options.match.cage || options.match.cage_mesh != nullptr)
    return result;
  for (double share = kFirstShare; share <= kFarthestShare && missed(result) > kFewMissed;
       share *= 2) {
    BakeOptions wide = options;
    wide.match.max_distance = Length::share(share);
    auto next = attempt(wide);
    if (missed(next) > kMostLeft * missed(result)) break;
    result = std::move(next);
    options.match.max_distance = wide.match.max_distance;
  }
  return result;
}

}  // namespace kiln
