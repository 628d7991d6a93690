// Session: when only some of a band's texels are baked again, the inputs of their samples are copied into
// compact arrays.
#include "shared/common.h"

/// Copies the low poly's points and the correspondences of the selected texels' samples.
kernel void kiln_session_gather(const uint count,
                                const uint capacity,
                                const uint match_capacity,
                                const uint chosen_capacity,
                                global const uint* restrict chosen,
                                global const uint* restrict chosen_first,
                                global const uint* restrict texel_first,
                                global const uint* restrict low_triangle,
                                global const float* restrict low_barycentric,
                                global const uint* restrict triangle,
                                global const float* restrict barycentric,
                                global uint* restrict chosen_low_triangle,
                                global float* restrict chosen_low_barycentric,
                                global uint* restrict chosen_triangle,
                                global float* restrict chosen_barycentric) {
  const size_t i = get_global_id(0);
  if (i >= count) return;
  const size_t begin = texel_first[chosen[i]];
  const size_t end = texel_first[chosen[i] + 1u];
  size_t to = chosen_first[i];
  for (size_t from = begin; from < end; ++from, ++to) {
    chosen_low_triangle[to] = low_triangle[from];
    chosen_low_barycentric[to] = low_barycentric[from];
    chosen_low_barycentric[to + chosen_capacity] = low_barycentric[from + capacity];
    chosen_triangle[to] = triangle[from];
    chosen_barycentric[to] = barycentric[from];
    chosen_barycentric[to + chosen_capacity] = barycentric[from + match_capacity];
  }
}
