// Detail: what to read at the corresponding points (D), and averaging samples to texels.
//
// Normals of the dense mesh are interpolated at the matched point and expressed in the light mesh's
// frame: MikkTSpace's tangent frame (Mikkelsen 2008), object space, or the face's own frame (Wang,
// Froehlich, Goebel, "Fast Normal Map Generation for Simplified Meshes", section 3). The tangent frame is
// interpolated and not normalised, as shaders do it, and inverted exactly: so decoding with
// x * T + y * B + z * N gives back the direction of the dense normal.
//
// kernel               global      local  memory traffic an item
// kiln_detail_normal   samples     64     reads 29 B + 2 triangles' attributes (gathered), writes 12 B
// kiln_detail_blend    samples     64     the same, and of the other match 16 B + 2 triangles' attributes
// kiln_detail_resolve  texels      64     reads 12 B + 13 B a sample, writes 13 B (scattered)
//
// Strengths: one pass, no divergence but the miss. Limits: barycentric interpolation only.

#include "detail/detail.clh"

kernel void kiln_detail_normal(const kiln_detail_params params,
                               global const uint* restrict low_triangle,
                               global const float* restrict low_barycentric,
                               global const kiln_low_shading* restrict shading,
                               global const uint* restrict hit_triangle,
                               global const float* restrict hit_barycentric,
                               global const uint* restrict normal_indices,
                               global const float* restrict normals,
                               global float* restrict result) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  global const kiln_low_shading* low = shading + low_triangle[i];
  const float low_u = low_barycentric[i];
  const float low_v = low_barycentric[i + params.low_capacity];
  const float3 frame_normal = detail_frame_normal(low, low_u, low_v);
  const float3 normal =
      detail_source_normal(params, low, frame_normal, hit_triangle[i], hit_barycentric[i],
                           hit_barycentric[i + params.hit_capacity], normal_indices, normals);
  detail_store(detail_to_map(params, low, low_u, low_v, frame_normal, normal), i,
               params.out_capacity, result);
}

/// The same with the normals of two correspondences mixed where the other one has a triangle.
/// \param shares  how much of the first a sample takes
kernel void kiln_detail_blend(const kiln_detail_params params,
                              const uint other_capacity,
                              global const uint* restrict low_triangle,
                              global const float* restrict low_barycentric,
                              global const kiln_low_shading* restrict shading,
                              global const uint* restrict hit_triangle,
                              global const float* restrict hit_barycentric,
                              global const uint* restrict other_triangle,
                              global const float* restrict other_barycentric,
                              global const float* restrict shares,
                              global const uint* restrict normal_indices,
                              global const float* restrict normals,
                              global float* restrict result) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  global const kiln_low_shading* low = shading + low_triangle[i];
  const float low_u = low_barycentric[i];
  const float low_v = low_barycentric[i + params.low_capacity];
  const float3 frame_normal = detail_frame_normal(low, low_u, low_v);
  float3 normal =
      detail_source_normal(params, low, frame_normal, hit_triangle[i], hit_barycentric[i],
                           hit_barycentric[i + params.hit_capacity], normal_indices, normals);
  const uint triangle = other_triangle[i];
  if (triangle != KILN_NO_TRIANGLE) {
    const float3 other =
        detail_source_normal(params, low, frame_normal, triangle, other_barycentric[i],
                             other_barycentric[i + other_capacity], normal_indices, normals);
    const float share = shares[i];
    normal = detail_unit(normal * share + other * (1.0f - share), normal);
  }
  detail_store(detail_to_map(params, low, low_u, low_v, frame_normal, normal), i,
               params.out_capacity, result);
}

/// Averages a texel's samples and normalises, where there are several. Writes three interleaved floats and a coverage byte (1
/// baked, 2 missed) at the texel's place in the band.
kernel void kiln_detail_resolve(const kiln_resolve_params params,
                                global const uint* restrict texel_index,
                                global const uint* restrict texel_first,
                                global const uint* restrict hit_triangle,
                                global const float* restrict values,
                                global float* restrict image,
                                global uchar* restrict coverage) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.texel_count) return;
  const uint begin = texel_first[i];
  const uint end = texel_first[i + 1];
  const size_t capacity = params.capacity;
  float3 sum = (float3)(0.0f);
  float3 first_value = (float3)(0.0f, 0.0f, 1.0f);
  uint hits = 0u;
  uint used = 0u;
  for (uint s = begin; s < end; ++s) {
    const bool hit = hit_triangle[s] != KILN_NO_TRIANGLE;
    hits += hit ? 1u : 0u;
    if (!hit && params.miss != KILN_MISS_KEEP) continue;
    const float3 value = (float3)(values[s], values[s + capacity], values[s + 2 * capacity]);
    if (used == 0u) first_value = value;
    sum += value;
    ++used;
  }
  float3 value = used == 1u ? first_value : detail_unit(sum, first_value);
  if (used == 0u) {
    value = params.miss == KILN_MISS_MARK ? (float3)(1.0f, -1.0f, 1.0f) : (float3)(0.0f, 0.0f, 1.0f);
  }
  const uint texel = texel_index[i];
  vstore3(value, texel, image);
  coverage[texel] = hits != 0u ? 1 : 2;
}
