// Assess: how far apart a point of the light mesh and its match are in pictures from many directions.
//
// Tarini, Cignoni, Scopigno 2003, "Visibility based methods and assessment for detail-recovery", section
// 4.2. For each direction: samples that face it are aimed at the viewer; rays (occlusion.cl) find which of
// them the light mesh hides; the distances of the others add up. One work-item owns a sample's sums, in
// the directions' order.
//
// kernel              global   local  memory traffic an item
// kiln_assess_aim     samples  64     reads 12 B, writes 12 B
// kiln_assess_gather  samples  64     reads 25 B, updates 8 B
//
// Strengths: no picture is stored, so there is no pixel size to choose. Limits: a ray for every sample and
// direction.
#include "lib/vector3.clh"
#include "shared/assess.h"

static inline float3 assess_vector(global const float* planes, size_t i, size_t plane) {
  return (float3)(planes[i], planes[i + plane], planes[i + 2 * plane]);
}

/// Writes the directions (planes 3 to 5 of `points`): the viewer's, or 0 (no ray) where a face is turned
/// away.
kernel void kiln_assess_aim(const kiln_assess_params params, global const float* restrict normals,
                            global float* restrict points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const float3 toward = vload3(0, params.direction);
  const bool faces = dot3(assess_vector(normals, i, plane), toward) > 0.0f;
  points[i + 3 * plane] = faces ? toward.x : 0.0f;
  points[i + 4 * plane] = faces ? toward.y : 0.0f;
  points[i + 5 * plane] = faces ? toward.z : 0.0f;
}

/// \param offsets  from the sample to its match
/// \param hidden   by the light mesh; 0 where no ray was cast
/// \param sums     2 planes: of the cosines to the viewer where a sample is visible, and of the distances
///                 in the picture times the cosine
kernel void kiln_assess_gather(const kiln_assess_params params,
                               global const float* restrict normals,
                               global const float* restrict offsets,
                               global const uchar* restrict hidden, global float* restrict sums) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const float3 toward = vload3(0, params.direction);
  const float cosine = dot3(assess_vector(normals, i, plane), toward);
  if (!(cosine > 0.0f) || hidden[i] != 0) return;
  const float3 offset = assess_vector(offsets, i, plane);
  const float3 across = offset - toward * dot3(offset, toward);
  sums[i] += cosine;
  sums[i + plane] += cosine * sqrt(dot3(across, across));
}
