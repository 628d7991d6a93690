// Settings and arrays shared by all code that casts rays over hemispheres.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "accel/ray.h"
#include "cl/context.h"
#include "detail/registry.h"
#include "shared/hemisphere.h"

namespace kiln {

// Minimum distance of a hit, in frame units. Nearer hits are rounding errors: the ray hits the face
// that it starts on.
inline constexpr float kMinHitDistance = 0x1p-20F;
inline RayQuery make_ray_query(float distance, bool back_faces) {
  RayQuery query;
  query.t_min = std::min(kMinHitDistance, distance / 2);
  query.t_max = distance;
  query.inward = true;  // Rays run against the stored directions, which have the opposite sign
  query.two_sided = back_faces;
  return query;
}

/// Number of texels in one task of a parallel loop.
inline constexpr std::size_t kTexelsPerPiece = std::size_t{1} << 16;

/// Number of samples whose rays are cast together. Their data fits in a core's cache, and they are
/// close to each other in space.
inline constexpr std::uint32_t kSamplesPerPiece = 1U << 14;

inline constexpr std::uint32_t kLanes = KILN_HEMISPHERE_LANES;
/// Rounds up to a multiple of kLanes.
constexpr std::uint32_t round_up_to_lanes(std::uint32_t count) {
  return (count + kLanes - 1) / kLanes * kLanes;
}

/// False if occlusion is gathered by rays, whichever meshes and sizes are baked.
bool may_use_views(const OcclusionOptions& occlusion);

/// Number of depth views by which visibility is computed (OcclusionOptions::by); 0 if it is
/// computed by rays.
std::uint32_t views_for(const MapRequest& request);

/// Grows an array if it is too small; growing discards its contents.
template <typename T>
void make_room(cl::Context& context, cl::Array<T>& array, std::size_t size) {
  if (array.size() >= size) return;
  array = cl::Array<T>();
  array = cl::Array<T>(context, size);
}

}  // namespace kiln
