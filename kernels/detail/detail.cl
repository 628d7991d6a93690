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

#include "lib/vector3.clh"
#include "shared/detail.h"
#include "shared/match.h"

/// Unit vector along v; `fallback` where v has no direction.
static float3 detail_unit(float3 v, float3 fallback) {
#pragma OPENCL FP_CONTRACT OFF
  const float squared = dot3(v, v);
  if (!(squared > 1e-20f)) return fallback;
  return v / sqrt(squared);
}

/// Interpolates three vectors, stored one after another, at weights of corners 1 and 2.
static float3 detail_interpolate(global const float* corners, float u, float v) {
#pragma OPENCL FP_CONTRACT OFF
  const float w = 1.0f - u - v;
  return vload3(0, corners) * w + vload3(1, corners) * u + vload3(2, corners) * v;
}

/// The light mesh's interpolated normal, not normalised.
static float3 detail_frame_normal(global const kiln_low_shading* low, float low_u, float low_v) {
  return detail_interpolate(low->normal, low_u, low_v);
}

/// The dense surface's unit normal at a matched point; the light mesh's where nothing was found.
static float3 detail_source_normal(const kiln_detail_params params,
                                   global const kiln_low_shading* low, float3 frame_normal,
                                   uint triangle, float u, float v,
                                   global const uint* normal_indices,
                                   global const float* normals) {
#pragma OPENCL FP_CONTRACT OFF
  const float3 face_normal = vload3(0, low->face_normal);
  if (triangle == KILN_NO_TRIANGLE) return detail_unit(frame_normal, face_normal);
  const float w = 1.0f - u - v;
  const uint3 index = vload3(triangle, normal_indices);
  const float3 sum = vload3(index.x, normals) * w + vload3(index.y, normals) * u +
                     vload3(index.z, normals) * v;
  const float3 normal = detail_unit(sum, face_normal);
  return params.two_sided != 0u && dot3(normal, frame_normal) < 0.0f ? -normal : normal;
}

/// A unit normal in the map's space.
static float3 detail_to_map(const kiln_detail_params params, global const kiln_low_shading* low,
                            float low_u, float low_v, float3 frame_normal, float3 normal) {
#pragma OPENCL FP_CONTRACT OFF
  float3 value = normal;
  if (params.space == KILN_SPACE_TANGENT) {
    const float3 tangent = detail_interpolate(low->tangent, low_u, low_v);
    const float3 bitangent = cross3(frame_normal, tangent) * low->sign;
    // Cramer's rule up to the determinant's magnitude, which normalising removes.
    const float3 across = cross3(bitangent, frame_normal);
    const float determinant = dot3(tangent, across);
    value = (float3)(dot3(normal, across),
                     dot3(normal, cross3(frame_normal, tangent)),
                     dot3(normal, cross3(tangent, bitangent)));
    if (determinant < 0.0f) value = -value;
    value = detail_unit(value, (float3)(0.0f, 0.0f, 1.0f));
  } else if (params.space == KILN_SPACE_FACE) {
    const float3 face_normal = vload3(0, low->face_normal);
    const float3 x_axis = vload3(0, low->face_tangent);
    // Right-handed for mirrored UVs too: the shader derives y from the normal and x in the same way.
    const float3 y_axis = cross3(face_normal, x_axis);
    value = (float3)(dot3(normal, x_axis), dot3(normal, y_axis),
                     dot3(normal, face_normal));
    value = detail_unit(value, (float3)(0.0f, 0.0f, 1.0f));
  }
  if (params.two_component != 0u && value.z < 0.0f) {
    value = detail_unit((float3)(value.x, value.y, 0.0f), (float3)(1.0f, 0.0f, 0.0f));
  }
  value.y *= params.y_scale;
  return value;
}

static void detail_store(float3 value, size_t i, size_t plane, global float* result) {
  result[i] = value.x;
  result[i + plane] = value.y;
  result[i + 2 * plane] = value.z;
}

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
