// Two boxes as one vector.
#pragma once

#include "base/two.h"
#include "mesh/vector.h"

namespace kiln {

inline Two larger(Two a, Two b) { return a < b ? b : a; }

/// Squared distances of two boxes, without branches: which side of a box a point is on cannot be foretold.
template <typename Box>
Two squared_to_boxes(const Vec3d& p, const Box& one, const Box& other) {
  const auto outside = [](double at, float low, float other_low, float high, float other_high) {
    const Two below = Two{low, other_low} - Two{at, at};
    const Two above = Two{at, at} - Two{high, other_high};
    return larger(larger(below, above), Two{0, 0});
  };
  const Two x = outside(p.x, one.low.x, other.low.x, one.high.x, other.high.x);
  const Two y = outside(p.y, one.low.y, other.low.y, one.high.y, other.high.y);
  const Two z = outside(p.z, one.low.z, other.low.z, one.high.z, other.high.z);
  return x * x + y * y + z * z;
}

}  // namespace kiln
