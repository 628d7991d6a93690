// Smooths shares of rays over the surface: each texel is averaged with its eight neighbours, across seams too,
// weighted by their similarity.
//
// Two estimates of each texel, from independent rays, are smoothed separately with the same weights, so that
// each measures the bias of the other (host/detail/ao_denoiser.h). Weights depend on the high poly's points
// alone, never on the shares: the filter is linear, so the error of a sum is the sum of the errors.
//
// kernel              global  local  memory traffic an item
// kiln_share_weights  texels  64     reads 56 B + 8 points (gathered), writes 32 B
// kiln_share_smooth   texels  64     reads 40 B + 8 values (gathered), writes 8 B
// kiln_share_lean     texels  64     reads 32 B, writes 8 B
//
// A texel's neighbours are consecutive, so that all eight are one vector.
//
// Strengths: a step costs as much as reading one ray. Limits: weights do not depend on shadows: where a
// shadow's edge crosses a flat face, only the host's choice of the number of steps preserves that edge.

#include "lib/unroll.clh"
#include "shared/ao_denoiser.h"

// Difference 1 - cos of normals at and above which a neighbour has no weight (26 degrees).
#define NORMAL_REACH 0.1f
// A neighbour more than this many times as far away as the nearest one lies beyond a discontinuity.
#define JUMP 6.0f
// The weight of a texel itself if it has three neighbours.
#define OWN_WEIGHT 0.25f

/// Gathers one plane's values of eight texels.
static inline float8 share_gather(global const float* plane, const uint which[8]) {
  float found[KILN_SHARE_NEIGHBOURS];
  KILN_UNROLL
  for (int k = 0; k < KILN_SHARE_NEIGHBOURS; ++k) found[k] = plane[which[k]];
  return vload8(0, found);
}

/// Computes the weight of each neighbour in a step, in 256ths, packed above the neighbour's index.
/// These weights and the texel's own weight sum to 1.
/// \param neighbours indices per texel, below 2^24; the texel's own index in place of a missing neighbour
/// \param points      positions, then unit normals, one plane per component
kernel void kiln_share_weights(const kiln_share_params params,
                               global uint* restrict neighbours,
                               global const float* restrict points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.points;
  const uint8 neighbour_indices = vload8(i, neighbours);
  uint which[KILN_SHARE_NEIGHBOURS];
  vstore8(neighbour_indices, 0, which);
  float8 step[3], along[3];
  KILN_UNROLL
  for (int axis = 0; axis < 3; ++axis) {
    global const float* position = points + axis * plane;
    global const float* normal = points + (3 + axis) * plane;
    step[axis] = share_gather(position, which) - position[i];
    along[axis] = normal[i] * share_gather(normal, which);
  }
  const float8 squares = (step[0] * step[0] + step[1] * step[1]) + step[2] * step[2];
  const float8 away = squares * (float8)(1.0f, 1.0f, 1.0f, 1.0f, 0.5f, 0.5f, 0.5f, 0.5f);
  const int8 other = neighbour_indices != (uint8)((uint)i);
  const float8 counted = select((float8)(INFINITY), away, other & (away > 0.0f));
  const float4 fewer = min(counted.lo, counted.hi);
  const float nearest = min(min(fewer.x, fewer.y), min(fewer.z, fewer.w));
  const float8 apart = 1.0f - ((along[0] + along[1]) + along[2]);
  const float8 alike = max(0.0f, 1.0f - apart * (1.0f / NORMAL_REACH));
  const float8 share =
      select((float8)(0.0f), alike * alike, other & (away <= (float8)(JUMP * JUMP * nearest)));
  const float sum = 1.0f + share.s0 + share.s1 + share.s2 + share.s3 + share.s4 + share.s5 +
                    share.s6 + share.s7;
  vstore8(neighbour_indices | convert_uint8(share / sum * 256.0f) << 24u, i, neighbours);
}

/// Applies one step to both estimates.
kernel void kiln_share_smooth(const kiln_share_params params,
                              global const uint* restrict neighbours,
                              global const float* restrict from,
                              global float* restrict to) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const uint8 packed = vload8(i, neighbours);
  const float8 weight = convert_float8(packed >> 24u) * (1.0f / 256.0f);
  uint which[KILN_SHARE_NEIGHBOURS];
  float part[KILN_SHARE_NEIGHBOURS];
  vstore8(packed & 0xffffffu, 0, which);
  vstore8(weight, 0, part);
  float2 sum = (float2)(0.0f);
  KILN_UNROLL
  for (int k = 0; k < KILN_SHARE_NEIGHBOURS; ++k) sum += part[k] * vload2(which[k], from);
  // Weights are 256ths: their sum is exact in any order.
  const float4 pair_sums = weight.lo + weight.hi;
  const float own_weight = 1.0f - ((pair_sums.x + pair_sums.y) + (pair_sums.z + pair_sums.w));
  vstore2(sum + own_weight * vload2(i, from), i, to);
}

/// Squared distance in texels between a texel and the centroid of its weights, written to both values of a pair. A
/// texel with fewer than three neighbours uses its own weight instead, since little of its noise is averaged out.
/// Neighbours are in the order of AoDenoiser::prepare().
kernel void kiln_share_lean(const kiln_share_params params,
                            global const uint* restrict neighbours,
                            global float* restrict lean) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const float8 weight = convert_float8(vload8(i, neighbours) >> 24u) * (1.0f / 256.0f);
  // Weights are 256ths: sums are exact in any order.
  const float x = (weight.s1 + weight.s5 + weight.s7) - (weight.s0 + weight.s4 + weight.s6);
  const float y = (weight.s3 + weight.s6 + weight.s7) - (weight.s2 + weight.s4 + weight.s5);
  const float4 pair_sums = weight.lo + weight.hi;
  const float own_weight = 1.0f - ((pair_sums.x + pair_sums.y) + (pair_sums.z + pair_sums.w));
  vstore2((float2)(x * x + y * y + max(0.0f, own_weight - OWN_WEIGHT)), i, lean);
}
