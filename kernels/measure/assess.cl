// Assess: compares viewing rays of many directions on a low poly with its match and the high poly.
//
// Tarini, Cignoni, Scopigno 2003, "Visibility based methods and assessment for detail-recovery", sections
// 4.1 and 4.2. For each direction: samples that face it are aimed at the viewer; rays (occlusion.cl) find
// those that the low poly hides. For the visible ones, rays (ray.cl) find the high poly's point that the
// viewer would see, and distances are summed. One work-item owns a sample's sums, in the directions'
// order.
//
// kernel                          global   local  memory traffic an item
// kiln_assess_set_ray_directions  samples  64     reads 12 B, writes 12 B
// kiln_assess_gather              samples  64     reads 25 B, updates 12 B, writes 12 B
// kiln_assess_compare             samples  64     reads 44 B + 12 B (gathered), updates 12 B
//
// Strengths: no picture is stored, so there is no pixel size to choose. Limits: two rays for every sample
// and direction.
#include "lib/vector3.clh"
#include "shared/assess.h"

static inline float3 assess_load_vector(global const float* planes, size_t i, size_t plane) {
  return (float3)(planes[i], planes[i + plane], planes[i + 2 * plane]);
}

/// Adds a distance and its square, times a weight, to three planes of sums.
static inline void assess_add(global float* sums, size_t i, size_t plane, float weight,
                              float distance) {
#pragma OPENCL FP_CONTRACT OFF
  sums[i] += weight;
  sums[i + plane] += weight * distance;
  sums[i + 2 * plane] += weight * (distance * distance);
}

/// Writes the samples' directions (planes 3 to 5 of `points`): towards the viewer, or 0 (no ray) if the face is turned
/// away.
kernel void kiln_assess_set_ray_directions(const kiln_assess_params params,
                                           global const float* restrict normals,
                                           global float* restrict points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const float3 toward = vload3(0, params.direction);
  const bool faces_viewer = dot3(assess_load_vector(normals, i, plane), toward) > 0.0f;
  points[i + 3 * plane] = faces_viewer ? toward.x : 0.0f;
  points[i + 4 * plane] = faces_viewer ? toward.y : 0.0f;
  points[i + 5 * plane] = faces_viewer ? toward.z : 0.0f;
}

/// Adds the distances from matched points to the viewing rays, and clears the directions of hidden samples.
/// \param offsets  from the sample to its matched point
/// \param hidden 1 if the low poly hides the sample; 0 if it does not, or if no ray was cast
/// \param sums     KILN_ASSESS_SUMS planes
kernel void kiln_assess_gather(const kiln_assess_params params,
                               global const float* restrict normals,
                               global const float* restrict offsets,
                               global const uchar* restrict hidden, global float* restrict points,
                               global float* restrict sums) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const float3 toward = vload3(0, params.direction);
  const float cosine = dot3(assess_load_vector(normals, i, plane), toward);
  if (!(cosine > 0.0f)) return;
  if (hidden[i] != 0) {
    for (int k = 3; k < 6; ++k) points[i + k * plane] = 0.0f;
    return;
  }
  const float3 offset = assess_load_vector(offsets, i, plane);
  const float3 distance_to_ray = offset - toward * dot3(offset, toward);
  assess_add(sums + KILN_ASSESS_SEEN * plane, i, plane, cosine, sqrt(dot3(distance_to_ray, distance_to_ray)));
}

/// Adds the distances from matched points to the rays' first hits on the high poly, if these are on
/// front faces.
/// \param points         aimed samples; those without a direction have no ray
/// \param dense_normals  unit normals of the high poly's faces
/// \param triangle       triangle hit by the ray, or KILN_NO_TRIANGLE
/// \param distance       along the direction, from the sample
kernel void kiln_assess_compare(
    const kiln_assess_params params, global const float* restrict normals,
    global const float* restrict offsets, global const float* restrict points,
    global const float* restrict dense_normals, global const uint* restrict triangle,
    global const float* restrict distance, global float* restrict sums) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const float3 toward = assess_load_vector(points + 3 * plane, i, plane);
  if (triangle[i] == KILN_NO_TRIANGLE || !(dot3(toward, toward) > 0.0f)) return;
  if (!(dot3(vload3(triangle[i], dense_normals), toward) > 0.0f)) return;
  const float cosine = dot3(assess_load_vector(normals, i, plane), toward);
  const float3 distance_to_hit = assess_load_vector(offsets, i, plane) - toward * distance[i];
  assess_add(sums + KILN_ASSESS_MET * plane, i, plane, cosine, sqrt(dot3(distance_to_hit, distance_to_hit)));
}
