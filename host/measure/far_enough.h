// How far to search from low polys that were made here: they may stray farther than bakes search.
#pragma once

#include <utility>

#include "kiln/bake.h"

namespace kiln {

/// Whether nothing says how far to search.
inline bool leaves_distance_open(const BakeOptions& options) {
  return !options.max_distance && !options.cage && options.cage_mesh == nullptr;
}

/// A try. Where much is missed, further ones search twice as far each, as long as that helps.
/// \param options  get the distance that was taken, where another than that of bakes was
/// \param attempt  makes a result of options
/// \param missed   share of its samples without a point
template <class Attempt, class Missed>
auto far_enough(BakeOptions& options, const Attempt& attempt, const Missed& missed) {
  constexpr double kFewMissed = 0.005;  // shares of the samples
  constexpr double kMostLeft = 0.75;    // what must be left of those that were missed, at most
  constexpr double kFirstShare = 0.04, kFarthestShare = 0.16;  // shares of the diagonal
  auto result = attempt(options);
  if (!leaves_distance_open(options)) return result;
  for (double share = kFirstShare; share <= kFarthestShare && missed(result) > kFewMissed;
       share *= 2) {
    BakeOptions wide = options;
    wide.max_distance = Length::share(share);
    auto next = attempt(wide);
    if (missed(next) > kMostLeft * missed(result)) break;
    result = std::move(next);
    options.max_distance = wide.max_distance;
  }
  return result;
}

}  // namespace kiln
