// Settings and arrays that all casting of rays over hemispheres has in common.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "accel/ray.h"
#include "cl/context.h"
#include "detail/registry.h"
#include "shared/hemisphere.h"

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

/// Texels that a thread of the host takes at a time.
inline constexpr std::size_t kTexelsOfPiece = std::size_t{1} << 16;

/// Samples whose rays are cast together: their data stays in a core's cache, and they lie close together.
inline constexpr std::uint32_t kPiece = 1U << 14;

inline constexpr std::uint32_t kLanes = KILN_HEMISPHERE_LANES;
/// Rounded up to whole work-items.
constexpr std::uint32_t padded(std::uint32_t count) {
  return (count + kLanes - 1) / kLanes * kLanes;
}

/// Number of depth views that gather the light (OcclusionOptions::by); 0: rays do.
std::uint32_t views_for(const MapRequest& request);

/// Grows an array, whose content is lost then.
template <typename T>
void make_room(cl::Context& context, cl::Array<T>& array, std::size_t size) {
  if (array.size() >= size) return;
  array = cl::Array<T>();
  array = cl::Array<T>(context, size);
}

}  // namespace kiln
