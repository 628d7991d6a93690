// Matching some of a band's samples: their points are copied close together, and what was found for them is
// put where they lie. So what one method leaves undecided another can decide.
//
// kernel              global  local  memory traffic an item
// kiln_match_gather   chosen  64     reads 28 B + 4 B, writes 28 B
// kiln_match_scatter  chosen  64     reads 21 B, writes 17 B where something was found
// kiln_match_end      sample  64     reads 53 B, writes 17 B where something lies too deep
#include "lib/shell.clh"
#include "shared/match.h"

/// Copies chosen samples' points close together.
kernel void kiln_match_gather(const uint count,
                              const uint capacity,
                              const uint chosen_capacity,
                              global const uint* restrict chosen,
                              global const float* restrict points,
                              global float* restrict chosen_points) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  const size_t from = chosen[i];
  for (size_t plane = 0; plane < 7; ++plane) {
    chosen_points[plane * chosen_capacity + i] = points[plane * capacity + from];
  }
}

/// Takes over what was found for chosen samples.
kernel void kiln_match_scatter(const uint count,
                               const uint chosen_capacity,
                               const uint result_capacity,
                               global const uint* restrict chosen,
                               global const uint* restrict triangle,
                               global const float* restrict barycentric,
                               global const float* restrict distance,
                               global const uchar* restrict status,
                               global uint* restrict hit_triangle,
                               global float* restrict hit_barycentric,
                               global float* restrict hit_distance,
                               global uchar* restrict hit_status) {
  const size_t i = get_global_id(0);
  if (i >= count || triangle[i] == KILN_NO_TRIANGLE) return;
  const size_t to = chosen[i];
  hit_triangle[to] = triangle[i];
  hit_barycentric[to] = barycentric[i];
  hit_barycentric[to + result_capacity] = barycentric[i + chosen_capacity];
  hit_distance[to] = distance[i];
  hit_status[to] = status[i];
}

/// Samples whose point lies beyond an inner shell miss.
kernel void kiln_match_end(const uint count,
                           const uint capacity,
                           const uint hit_capacity,
                           global const float* restrict shell,  // 6 a triangle: unit normal, depths
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
