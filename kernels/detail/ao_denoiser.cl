// Smooths ambient occlusion, the share of unoccluded rays of each texel, over the surface: each texel is averaged with
// its eight neighbours, across seams too, weighted by their similarity.
//
// Two estimates of each texel, from independent rays, are smoothed separately with the same weights, so that
// each measures the bias of the other (host/detail/ao_denoiser.h). Weights depend on the high poly's points
// alone, never on the shares: the filter is linear, so the error of a sum is the sum of the errors.
//
// kernel                              global  local  memory traffic an item
// kiln_ao_denoiser_compute_weights    texels  64     reads 56 B + 8 points (gathered), writes 32 B
// kiln_ao_denoiser_smooth             texels  64     reads 40 B + 8 values (gathered), writes 8 B
// kiln_ao_denoiser_measure_centroids  texels  64     reads 32 B, writes 8 B
//
// A texel's neighbours are consecutive, so that all eight are one vector.
//
// Strengths: a smoothing step costs as much as reading one ray per texel. Limits: weights do not depend on shadows. An
// edge of a shadow on a flat face is only preserved by the number of steps that the host chooses.

#include "lib/unroll.clh"
#include "shared/ao_denoiser.h"

// A neighbour has no weight if 1 minus the cosine of the angle between the normals is at least this (26 degrees).
#define MAX_NORMAL_DIFFERENCE 0.1f
// If a neighbour is farther away than the nearest one by more than this factor, it lies beyond a discontinuity and has
// no weight.
#define MAX_DISTANCE_RATIO 6.0f
// The weight of the texel itself if it has three neighbours.
#define MAX_OWN_WEIGHT 0.25f

/// Gathers the values of eight texels from an array of one component.
static inline float8 gather_values(global const float* plane, const uint index[8]) {
  float values[KILN_AO_DENOISER_NEIGHBOURS];
  KILN_UNROLL
  for (int k = 0; k < KILN_AO_DENOISER_NEIGHBOURS; ++k) values[k] = plane[index[k]];
  return vload8(0, values);
}

/// Computes the weight of each neighbour in a smoothing step in units of 1/256, packed into the bits above the
/// neighbour's index. The weights of the neighbours and of the texel itself sum to 1.
/// \param neighbours indices per texel, below 2^24; the texel's own index in place of a missing neighbour
/// \param points      positions, then unit normals, one plane per component
kernel void kiln_ao_denoiser_compute_weights(const kiln_ao_denoiser_params params,
                                             global uint* restrict neighbours,
                                             global const float* restrict points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.points;
  const uint8 neighbour_indices = vload8(i, neighbours);
  uint index[KILN_AO_DENOISER_NEIGHBOURS];
  vstore8(neighbour_indices, 0, index);
  float8 step[3], cosine_parts[3];
  KILN_UNROLL
  for (int axis = 0; axis < 3; ++axis) {
    global const float* position = points + axis * plane;
    global const float* normal = points + (3 + axis) * plane;
    step[axis] = gather_values(position, index) - position[i];
    cosine_parts[axis] = normal[i] * gather_values(normal, index);
  }
  const float8 squares = (step[0] * step[0] + step[1] * step[1]) + step[2] * step[2];
  const float8 squared_distance = squares * (float8)(1.0f, 1.0f, 1.0f, 1.0f, 0.5f, 0.5f, 0.5f, 0.5f);
  const int8 is_other = neighbour_indices != (uint8)((uint)i);
  const float8 valid_distance = select((float8)(INFINITY), squared_distance, is_other & (squared_distance > 0.0f));
  const float4 pair_min = min(valid_distance.lo, valid_distance.hi);
  const float nearest = min(min(pair_min.x, pair_min.y), min(pair_min.z, pair_min.w));
  const float8 normal_difference = 1.0f - ((cosine_parts[0] + cosine_parts[1]) + cosine_parts[2]);
  const float8 similarity = max(0.0f, 1.0f - normal_difference * (1.0f / MAX_NORMAL_DIFFERENCE));
  const float max_squared_distance = MAX_DISTANCE_RATIO * MAX_DISTANCE_RATIO * nearest;
  const float8 share = select((float8)(0.0f), similarity * similarity,
                              is_other & (squared_distance <= (float8)(max_squared_distance)));
  const float sum = 1.0f + share.s0 + share.s1 + share.s2 + share.s3 + share.s4 + share.s5 +
                    share.s6 + share.s7;
  vstore8(neighbour_indices | convert_uint8(share / sum * 256.0f) << 24u, i, neighbours);
}

/// Applies one smoothing step to both estimates.
kernel void kiln_ao_denoiser_smooth(const kiln_ao_denoiser_params params,
                                    global const uint* restrict neighbours,
                                    global const float* restrict from,
                                    global float* restrict to) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const uint8 packed = vload8(i, neighbours);
  const float8 weight = convert_float8(packed >> 24u) * (1.0f / 256.0f);
  uint index[KILN_AO_DENOISER_NEIGHBOURS];
  float weights[KILN_AO_DENOISER_NEIGHBOURS];
  vstore8(packed & 0xffffffu, 0, index);
  vstore8(weight, 0, weights);
  float2 sum = (float2)(0.0f);
  KILN_UNROLL
  for (int k = 0; k < KILN_AO_DENOISER_NEIGHBOURS; ++k) sum += weights[k] * vload2(index[k], from);
  // Weights are multiples of 1/256, so their sum is exact in any order.
  const float4 pair_sums = weight.lo + weight.hi;
  const float own_weight = 1.0f - ((pair_sums.x + pair_sums.y) + (pair_sums.z + pair_sums.w));
  vstore2(sum + own_weight * vload2(i, from), i, to);
}

/// Computes the squared distance in texels between each texel and the centroid of its weights, and writes it to both
/// values of a pair. A texel with fewer than three neighbours uses its own weight instead, since little of its noise is
/// averaged out. Neighbours are in the order of AoDenoiser::prepare().
kernel void kiln_ao_denoiser_measure_centroids(const kiln_ao_denoiser_params params,
                                               global const uint* restrict neighbours,
                                               global float* restrict offset) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const float8 weight = convert_float8(vload8(i, neighbours) >> 24u) * (1.0f / 256.0f);
  // Weights are multiples of 1/256, so sums are exact in any order.
  const float x = (weight.s1 + weight.s5 + weight.s7) - (weight.s0 + weight.s4 + weight.s6);
  const float y = (weight.s3 + weight.s6 + weight.s7) - (weight.s2 + weight.s4 + weight.s5);
  const float4 pair_sums = weight.lo + weight.hi;
  const float own_weight = 1.0f - ((pair_sums.x + pair_sums.y) + (pair_sums.z + pair_sums.w));
  vstore2((float2)(x * x + y * y + max(0.0f, own_weight - MAX_OWN_WEIGHT)), i, offset);
}
