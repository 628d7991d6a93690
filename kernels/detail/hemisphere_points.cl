// Computes where rays over hemispheres start: the samples' positions, normals and rotations.
//
// hemisphere.cl has the method, and hemisphere_cast.cl that of CPUs; both read what these kernels write.
//
// kernel                           global           local  memory traffic an item
// kiln_hemisphere_write_rotations  texels           64     reads 12 B + 4 B a sample, writes 4 B a sample
// kiln_hemisphere_write_keys       texels           64     the same
// kiln_hemisphere_write_points     samples, padded  64     reads 41 B + a triangle (gathered), writes 36 B
//
// No defines. Strengths: one item a texel or sample, no atomics. Limits: a point's triangle is gathered, so samples
// should be in the map's order.
#include "detail/detail.clh"
#include "lib/call.clh"
#include "lib/hash.clh"
#include "shared/hemisphere.h"

/// Rotation of each sample's rays, and below it the index of the set. It depends on the texel's position
/// in the map; samples of a texel have evenly spaced rotations.
kernel void kiln_hemisphere_write_rotations(const kiln_rotation_params params,
                                            global const uint* restrict texel_index,
                                            global const uint* restrict texel_first,
                                            global const uint* restrict sample_slot,
                                            global uint* restrict turns) {
  const size_t i = get_global_id(0);
  if (i >= params.texel_count) return;
  const uint texel = hash_of(params.first_texel + texel_index[i]);
  const uint end = texel_first[i + 1];
  for (uint s = texel_first[i]; s < end; ++s) {
    // Multiples of the golden ratio, modulo 1, are evenly spaced for any number of samples.
    turns[s] = (texel + sample_slot[s] * 2654435769u) >>
               (32 - KILN_HEMISPHERE_TURN_BITS - KILN_HEMISPHERE_SET_BITS);
  }
}

/// Computes the index of each sample along a Morton curve over the map, with the digit of the finest level first;
/// hemisphere_turn() shuffles the index. The curve continues over the samples within a texel.
kernel void kiln_hemisphere_write_keys(const kiln_rotation_params params,
                                       global const uint* restrict texel_index,
                                       global const uint* restrict texel_first,
                                       global const uint* restrict sample_slot,
                                       global uint* restrict keys) {
  const size_t i = get_global_id(0);
  if (i >= params.texel_count) return;
  const uint texel = params.first_texel + texel_index[i];
  const uint x = texel % params.width;
  const uint y = texel / params.width;
  uint key = 0;
  for (uint bit = 0; bit < 16; ++bit) {
    key |= (x >> bit & 1u) << (31 - 2 * bit) | (y >> bit & 1u) << (30 - 2 * bit);
  }
  const uint end = texel_first[i + 1];
  for (uint s = texel_first[i]; s < end; ++s) {
    uint slot = 0;
    for (uint bit = 0; bit < params.slot_bits; ++bit) {
      slot |= (sample_slot[s] >> bit & 1u) << (31 - bit);
    }
    keys[s] = (key >> params.slot_bits) | slot;
  }
}

/// A unit vector along v, even for very short v; 0 if v is 0 or not finite.
static inline float3 hemisphere_normalize(float3 v) {
#pragma OPENCL FP_CONTRACT OFF
  const float largest = max(fabs(v.x), max(fabs(v.y), fabs(v.z)));
  if (!(largest > 1e-30f)) return (float3)(0.0f);
  const float3 scaled = v / largest;
  return scaled / sqrt(dot3(scaled, scaled));
}

/// Computes positions, normals and offset vectors of the samples [first, first + count), or of picked[0], picked[1] and
/// so on. Samples without a point, and unused lanes at the end, get zero normals.
static KILN_CALL void hemisphere_compute_point(const size_t i, const kiln_hemisphere_params params,
                                               global const uint* KILN_CALL_RESTRICT low_triangle,
                                               global const float* KILN_CALL_RESTRICT low_barycentric,
                                               global const float* KILN_CALL_RESTRICT low_points,
                                               global const kiln_low_shading* KILN_CALL_RESTRICT shading,
                                               global const uint* KILN_CALL_RESTRICT hit_triangle,
                                               global const float* KILN_CALL_RESTRICT hit_barycentric,
                                               global const float* KILN_CALL_RESTRICT positions,
                                               global const uint* KILN_CALL_RESTRICT triangles,
                                               global const uint* KILN_CALL_RESTRICT normal_indices,
                                               global const float* KILN_CALL_RESTRICT normals,
                                               global const uint* KILN_CALL_RESTRICT picked,
                                               global float* KILN_CALL_RESTRICT points) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t plane = params.plane;
  const size_t s = params.by_list != 0u && i < params.count ? picked[i] : params.first + i;
  float3 position = (float3)(0.0f);
  float3 normal = (float3)(0.0f);
  float3 face = (float3)(0.0f);
  const uint triangle = i < params.count ? hit_triangle[s] : KILN_NO_TRIANGLE;
  if (i < params.count && (triangle != KILN_NO_TRIANGLE || params.keep != 0u)) {
    kiln_detail_params detail = {0};
    detail.two_sided = params.two_sided;
    const detail_low low = detail_read_low(detail, shading + low_triangle[s], low_barycentric[s],
                                           low_barycentric[s + params.low_capacity]);
    float u = 0.0f;
    float v = 0.0f;
    if (triangle == KILN_NO_TRIANGLE) {
      const size_t low_plane = params.low_capacity;
      position = (float3)(low_points[s], low_points[s + low_plane], low_points[s + 2 * low_plane]);
      face = low.face_normal;
    } else {
      u = hit_barycentric[s];
      v = hit_barycentric[s + params.hit_capacity];
      const uint3 corner = vload3(triangle, triangles);
      const float3 a = vload3(corner.x, positions);
      const float3 ab = vload3(corner.y, positions) - a;
      const float3 ac = vload3(corner.z, positions) - a;
      position = (a + ab * u) + ac * v;
      face = hemisphere_normalize(cross3(hemisphere_normalize(ab), hemisphere_normalize(ac)));
    }
    normal = detail_source_normal(detail, low, triangle, u, v, normal_indices, normals);
    if (dot3(face, face) == 0.0f) face = normal;
  }
  detail_store_planes(position, i, plane, points);
  detail_store_planes(normal, i, plane, points + 3 * plane);
  detail_store_planes(face * params.push, i, plane, points + 6 * plane);
}

kernel void kiln_hemisphere_write_points(
    const kiln_hemisphere_params params, global const uint* restrict low_triangle,
    global const float* restrict low_barycentric, global const float* restrict low_points,
    global const kiln_low_shading* restrict shading, global const uint* restrict hit_triangle,
    global const float* restrict hit_barycentric, global const float* restrict positions,
    global const uint* restrict triangles, global const uint* restrict normal_indices,
    global const float* restrict normals, global const uint* restrict picked,
    global float* restrict points) {
  const size_t i = get_global_id(0);
  if (i >= params.stride) return;
  hemisphere_compute_point(i, params, low_triangle, low_barycentric, low_points, shading, hit_triangle,
                           hit_barycentric, positions, triangles, normal_indices, normals, picked, points);
}
