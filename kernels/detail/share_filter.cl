// Smooths shares of rays over the surface: each texel takes from the eight beside it, across seams too, as much
// as they are alike.
//
// Two estimates of each texel, of other rays, are smoothed with the same weights but apart. So each can say
// what the other one loses (host/detail/share_filter.h). Weights know the high poly's points alone, never the
// shares: the filter is linear, and a sum of them has the error of its parts.
//
// kernel              global  local  memory traffic an item
// kiln_share_weights  texels  64     reads 56 B + 8 points (gathered), writes 32 B
// kiln_share_smooth   texels  64     reads 40 B + 8 values (gathered), writes 8 B
//
// Strengths: a step costs as much as reading one ray. Limits: what lies between texels is not known: where a
// shadow's edge crosses a flat face, only the host's choice of how often to smooth protects it.

#include "lib/vector3.clh"
#include "shared/share_filter.h"

// Normals that are 1 - cos apart by this much have nothing to do with each other (26 degrees).
#define NORMAL_REACH 0.1f
// A neighbour that is this often further away than the nearest one lies beyond a jump.
#define JUMP 6.0f

static inline float3 share_vector(global const float* points, size_t plane, size_t i) {
  return (float3)(points[i], points[i + plane], points[i + 2 * plane]);
}

/// How much of each neighbour a step takes, in 256ths, above its number. They and the texel's own part sum to 1.
/// \param neighbours  a plane each: their numbers, below 2^24, the texel's own where there is none
/// \param points      positions, then unit normals, a plane each axis
kernel void kiln_share_weights(const kiln_share_params params,
                               global uint* restrict neighbours,
                               global const float* restrict points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.points;
  const float3 at = share_vector(points, plane, i);
  const float3 normal = share_vector(points + 3 * plane, plane, i);
  float away[KILN_SHARE_NEIGHBOURS];
  float nearest = INFINITY;
  for (int k = 0; k < KILN_SHARE_NEIGHBOURS; ++k) {
    const size_t j = neighbours[i + k * (size_t)params.stride];
    const float3 step = share_vector(points, plane, j) - at;
    away[k] = dot3(step, step) * (k < 4 ? 1.0f : 0.5f);
    if (j != i && away[k] > 0.0f) nearest = min(nearest, away[k]);
  }
  float sum = 1.0f;
  for (int k = 0; k < KILN_SHARE_NEIGHBOURS; ++k) {
    const size_t j = neighbours[i + k * (size_t)params.stride];
    const float apart = 1.0f - dot3(normal, share_vector(points + 3 * plane, plane, j));
    const float alike = max(0.0f, 1.0f - apart * (1.0f / NORMAL_REACH));
    const bool takes = j != i && away[k] <= JUMP * JUMP * nearest;
    away[k] = takes ? alike * alike : 0.0f;
    sum += away[k];
  }
  for (int k = 0; k < KILN_SHARE_NEIGHBOURS; ++k) {
    neighbours[i + k * (size_t)params.stride] |= (uint)(away[k] / sum * 256.0f) << 24;
  }
}

/// One step of both estimates.
kernel void kiln_share_smooth(const kiln_share_params params,
                              global const uint* restrict neighbours,
                              global const float* restrict from,
                              global float* restrict to) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  float own = 1.0f;
  float2 sum = (float2)(0.0f);
  for (int k = 0; k < KILN_SHARE_NEIGHBOURS; ++k) {
    const uint packed = neighbours[i + k * (size_t)params.stride];
    const float weight = (float)(packed >> 24) * (1.0f / 256.0f);
    sum += weight * vload2(packed & 0xffffffu, from);
    own -= weight;
  }
  vstore2(sum + own * vload2(i, from), i, to);
}
