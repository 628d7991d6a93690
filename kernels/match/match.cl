// Kernels that run between two searches, so that data stays on the device: they change directions, and limit or select
// hits.
//
// kernel                   global  local  memory traffic an item
// kiln_match_reject_deep   sample  64     reads 53 B, writes 17 B if the point lies too deep
// kiln_match_set_axis      sample  64     reads 28 B, writes 28 B
// kiln_match_write_limits  sample  64     reads 32 B, writes 4 B
// kiln_match_select_outer  sample  64     reads 8 B, and 12 B more if there is a hit; writes 17 B if it is farther out
#include "lib/shell.clh"
#include "shared/match.h"

/// Turns a sample into a miss if its matched point lies below the inner shell.
kernel void kiln_match_reject_deep(const uint count,
                                   const uint capacity,
                                   const uint hit_capacity,
                                   // 6 per triangle: unit normal, then the inner shell's depth at each corner
                                   global const float* restrict shell,
                                   global const uint* restrict triangle,
                                   global const float* restrict barycentric,
                                   global const float* restrict points,
                                   global uint* restrict hit_triangle,
                                   global float* restrict hit_barycentric,
                                   global float* restrict hit_distance,
                                   global uchar* restrict hit_status) {
  const size_t i = get_global_id(0);
  if (i >= count || hit_triangle[i] == KILN_NO_TRIANGLE) return;
  const float deepest =
      shell_distance(shell + 6 * (size_t)triangle[i], i, capacity, barycentric, points);
  if (hit_distance[i] >= -deepest) return;
  hit_triangle[i] = KILN_NO_TRIANGLE;
  hit_barycentric[i] = 0.0f;
  hit_barycentric[hit_capacity + i] = 0.0f;
  hit_distance[i] = 0.0f;
  hit_status[i] = KILN_STATUS_MISS;
}

/// Copies points and replaces their directions by an axis, which is negated if it points against the sample's former
/// direction.
kernel void kiln_match_set_axis(const uint count,
                                const uint capacity,
                                const float x,
                                const float y,
                                const float z,
                                global const float* restrict points,
                                global float* restrict turned) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= count) return;
  const size_t plane = capacity;
  const float along = points[3 * plane + i] * x + points[4 * plane + i] * y + points[5 * plane + i] * z;
  const float sign = along < 0.0f ? -1.0f : 1.0f;
  for (size_t axis = 0; axis < 3; ++axis) turned[axis * plane + i] = points[axis * plane + i];
  turned[3 * plane + i] = sign * x;
  turned[4 * plane + i] = sign * y;
  turned[5 * plane + i] = sign * z;
  turned[6 * plane + i] = points[6 * plane + i];
}

/// Writes the search limit of each sample: the distance to the low poly's first hit; 0 if that hit is a back
/// face, so that the sample is inside another part.
kernel void kiln_match_write_limits(const uint count,
                                    const uint capacity,
                                    const float farthest,
                                    const uint first,                      // index of the first element of `limit` to write
                                    global const float* restrict normals,  // 3 per triangle: its unit normal
                                    global const float* restrict points,
                                    global const uint* restrict met,
                                    global const float* restrict distance,
                                    global float* limit) {  // [count]; a plane of the array of points is allowed
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= count) return;
  float max_distance = farthest;
  if (met[i] != KILN_NO_TRIANGLE) {
    float along = 0.0f;
    for (size_t axis = 0; axis < 3; ++axis) {
      along = fma(normals[3 * (size_t)met[i] + axis], points[(3 + axis) * capacity + i], along);
    }
    max_distance = along > 0.0f ? 0.0f : distance[i];
  }
  limit[first + i] = max_distance;
}

/// Replaces a hit by a second one that lies farther outward on another face.
kernel void kiln_match_select_outer(const uint count,
                                    const float same_face,
                                    global const uint* restrict outer_triangle,
                                    global const float* restrict outer_barycentric,
                                    global const float* restrict outer_distance,
                                    global uint* restrict triangle,
                                    global float* restrict barycentric,
                                    global float* restrict distance,
                                    global uchar* restrict status) {
  const size_t i = get_global_id(0);
  if (i >= count || outer_triangle[i] == KILN_NO_TRIANGLE) return;
  if (!(outer_distance[i] > distance[i] + same_face)) return;
  triangle[i] = outer_triangle[i];
  barycentric[i] = outer_barycentric[i];
  barycentric[(size_t)count + i] = outer_barycentric[(size_t)count + i];
  distance[i] = outer_distance[i];
  status[i] = KILN_STATUS_OUTERMOST;
}
