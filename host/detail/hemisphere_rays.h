// What all that casts rays over hemispheres has in common.
#pragma once

#include <algorithm>
#include <cstddef>

#include "accel/ray.h"
#include "cl/context.h"

namespace kiln {

// Hits nearer than this are rounding: a surface through the very point.
inline constexpr float kNearest = 0x1p-20F;
inline RayQuery query_up_to(float distance, bool back_faces) {
  RayQuery query;
  query.t_min = std::min(kNearest, distance / 2);
  query.t_max = distance;
  query.inward = true;  // directions are stored reversed
  query.two_sided = back_faces;
  return query;
}

/// Grows an array, whose content is lost then.
template <typename T>
void make_room(cl::Context& context, cl::Array<T>& array, std::size_t size) {
  if (array.size() >= size) return;
  array = cl::Array<T>();
  array = cl::Array<T>(context, size);
}

}  // namespace kiln
