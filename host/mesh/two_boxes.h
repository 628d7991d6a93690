// Computes distances to two boxes at once.
#pragma once

#include "base/vectors.h"
#include "mesh/vector.h"

namespace kiln {

/// Squared distances of a point to two boxes, as a vector. Computed without branches, which the processor could not
/// predict.
template <typename Box>
Double2 squared_distances_to_boxes(const Vec3d& p, const Box& one, const Box& other) {
  const auto outside = [](double at, float low, float other_low, float high, float other_high) {
    const Double2 distance_below = Double2{low, other_low} - Double2{at, at};
    const Double2 distance_above = Double2{at, at} - Double2{high, other_high};
    return larger(larger(distance_below, distance_above), Double2{0, 0});
  };
  const Double2 x = outside(p.x, one.low.x, other.low.x, one.high.x, other.high.x);
  const Double2 y = outside(p.y, one.low.y, other.low.y, one.high.y, other.high.y);
  const Double2 z = outside(p.z, one.low.z, other.low.z, one.high.z, other.high.z);
  return x * x + y * y + z * z;
}

}  // namespace kiln
