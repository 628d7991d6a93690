// Detail for CPUs: the same as kernels/detail.cl, eight samples to a work-item.
//
// Purpose: PoCL vectorises across work-items only where a kernel has neither branches nor gathers, which
// detail has; so vectors are written out. The result is that of detail.cl to the bit: the same operations in
// the same order, lane by lane.
//
// kernel                    global        local  memory traffic a sample
// kiln_detail_texel_wide    samples / 8   64     reads 33 B + 2 triangles' attributes (gathered), writes 13 B
// kiln_detail_normal_wide   samples / 8   64     reads 29 B + the same, writes 12 B
//
// Neighbouring samples mostly lie in one light triangle: its attributes are read once for all that do.
//
// The dense mesh's normals and their indices are read four numbers at a time: both arrays end in one more.
//
// Strengths: arithmetic at the width of the vector units, half the memory traffic at one sample a texel.
// Limits: blending and averaging stay in detail.cl.

#include "lib/wide3.clh"
#include "shared/detail.h"
#include "shared/match.h"

/// What a group of samples reads of the light mesh.
typedef struct detail_low {
  wide3 normal;   // interpolated, not normalised
  wide3 tangent;  // the same; in KILN_SPACE_FACE, of the face
  wide3 face_normal;
  float8 sign;
} detail_low;

/// Unit vectors along v; `fallback` where v has no direction.
static wide3 detail_unit(wide3 v, wide3 fallback) {
#pragma OPENCL FP_CONTRACT OFF
  const float8 squared = wide_dot(v, v);
  const int8 has_direction = squared > 1e-20f;
  const float8 size = select((float8)(1.0f), sqrt(squared), has_direction);
  const wide3 unit = {v.x / size, v.y / size, v.z / size};
  return wide_select(has_direction, unit, fallback);
}

static wide3 detail_interpolate(global const float* corners, float8 u, float8 v, float8 w) {
  return wide_mix(wide_of(corners[0], corners[1], corners[2]), w,
                  wide_of(corners[3], corners[4], corners[5]), u,
                  wide_of(corners[6], corners[7], corners[8]), v);
}

static detail_low detail_read_low(const kiln_detail_params params,
                                  global const kiln_low_shading* low, float8 u, float8 v) {
#pragma OPENCL FP_CONTRACT OFF
  const float8 w = 1.0f - u - v;
  detail_low result;
  result.normal = detail_interpolate(low->normal, u, v, w);
  if (params.space == KILN_SPACE_FACE) {
    result.tangent = wide_of(low->face_tangent[0], low->face_tangent[1], low->face_tangent[2]);
  } else {
    result.tangent = detail_interpolate(low->tangent, u, v, w);
  }
  result.face_normal = wide_of(low->face_normal[0], low->face_normal[1], low->face_normal[2]);
  result.sign = (float8)(low->sign);
  return result;
}

/// Of each lane's own light triangle: one reading for each that occurs.
static detail_low detail_gather_low(const kiln_detail_params params,
                                    global const kiln_low_shading* shading, uint8 triangle,
                                    float8 u, float8 v) {
  detail_low result = detail_read_low(params, shading + triangle.s0, u, v);
  int8 missing = triangle != triangle.s0;
  if (!wide_any(missing)) return result;
  uint pending[8];
  vstore8(triangle, 0, pending);
  for (uint lane = 1u; lane < 8u; ++lane) {
    const int8 mine = missing & (triangle == pending[lane]);
    if (!wide_any(mine)) continue;
    const detail_low own = detail_read_low(params, shading + pending[lane], u, v);
    result.normal = wide_select(mine, own.normal, result.normal);
    result.tangent = wide_select(mine, own.tangent, result.tangent);
    result.face_normal = wide_select(mine, own.face_normal, result.face_normal);
    result.sign = select(result.sign, own.sign, mine);
    missing &= ~mine;
  }
  return result;
}

/// Unit normals in the map's space.
static wide3 detail_to_map(const kiln_detail_params params, const detail_low low, wide3 normal) {
#pragma OPENCL FP_CONTRACT OFF
  const wide3 up = wide_of(0.0f, 0.0f, 1.0f);
  wide3 value = normal;
  if (params.space == KILN_SPACE_TANGENT) {
    const wide3 bitangent = wide_scaled(wide_cross(low.normal, low.tangent), low.sign);
    const wide3 across = wide_cross(bitangent, low.normal);
    const float8 determinant = wide_dot(low.tangent, across);
    value.x = wide_dot(normal, across);
    value.y = wide_dot(normal, wide_cross(low.normal, low.tangent));
    value.z = wide_dot(normal, wide_cross(low.tangent, bitangent));
    const int8 mirrored = determinant < 0.0f;
    const wide3 turned = {-value.x, -value.y, -value.z};
    value = detail_unit(wide_select(mirrored, turned, value), up);
  } else if (params.space == KILN_SPACE_FACE) {
    const wide3 y_axis = wide_cross(low.face_normal, low.tangent);
    value.x = wide_dot(normal, low.tangent);
    value.y = wide_dot(normal, y_axis);
    value.z = wide_dot(normal, low.face_normal);
    value = detail_unit(value, up);
  }
  if (params.two_component != 0u) {
    const wide3 flat = {value.x, value.y, (float8)(0.0f)};
    value = wide_select(value.z < 0.0f, detail_unit(flat, wide_of(1.0f, 0.0f, 0.0f)), value);
  }
  value.y *= params.y_scale;
  return value;
}

/// The values of a group's samples. \param lanes  indices of the samples, all below the count
static wide3 detail_values(const kiln_detail_params params, uint8 lanes, bool whole,
                           global const uint* low_triangle, global const float* low_barycentric,
                           global const kiln_low_shading* shading, global const float* hit_barycentric,
                           global const uint* normal_indices, global const float* normals,
                           uint8 hit) {
#pragma OPENCL FP_CONTRACT OFF
  const uint first = lanes.s0;
  global const float* low_v = low_barycentric + params.low_capacity;
  global const float* hit_v = hit_barycentric + params.hit_capacity;
  uint8 low;
  float8 lu, lv, u, v;
  if (whole) {
    low = vload8(0, low_triangle + first);
    lu = vload8(0, low_barycentric + first);
    lv = vload8(0, low_v + first);
    u = vload8(0, hit_barycentric + first);
    v = vload8(0, hit_v + first);
  } else {
    low = wide_gather_uint(low_triangle, lanes);
    lu = wide_gather(low_barycentric, lanes);
    lv = wide_gather(low_v, lanes);
    u = wide_gather(hit_barycentric, lanes);
    v = wide_gather(hit_v, lanes);
  }
  const detail_low frame = detail_gather_low(params, shading, low, lu, lv);

  const int8 found = hit != KILN_NO_TRIANGLE;
  const wide_uint4 corner =
      wide_gather4(normal_indices, select((uint8)(0u), hit, as_uint8(found)) * 3u);
  const wide3 n0 = wide_gather3(normals, corner.x);
  const wide3 n1 = wide_gather3(normals, corner.y);
  const wide3 n2 = wide_gather3(normals, corner.z);
  const float8 w = 1.0f - u - v;
  const wide3 own = wide_select(found, wide_mix(n0, w, n1, u, n2, v), frame.normal);
  wide3 normal = detail_unit(own, frame.face_normal);
  if (params.two_sided != 0u) {
    const int8 away = found & (wide_dot(normal, frame.normal) < 0.0f);
    const wide3 turned = {-normal.x, -normal.y, -normal.z};
    normal = wide_select(away, turned, normal);
  }
  return detail_to_map(params, frame, normal);
}

/// The samples of a work-item; past the end, the last one again.
static uint8 detail_lanes(const kiln_detail_params params, uint first) {
  return min(first + (uint8)(0u, 1u, 2u, 3u, 4u, 5u, 6u, 7u), params.count - 1u);
}

kernel void kiln_detail_normal_wide(const kiln_detail_params params,
                                    global const uint* restrict low_triangle,
                                    global const float* restrict low_barycentric,
                                    global const kiln_low_shading* restrict shading,
                                    global const uint* restrict hit_triangle,
                                    global const float* restrict hit_barycentric,
                                    global const uint* restrict normal_indices,
                                    global const float* restrict normals,
                                    global float* restrict result) {
  const uint first = (uint)get_global_id(0) * 8u;
  if (first >= params.count) return;
  const uint8 lanes = detail_lanes(params, first);
  const bool whole = first + 8u <= params.count;
  const uint8 hit = wide_gather_uint(hit_triangle, lanes);
  const wide3 value = detail_values(params, lanes, whole, low_triangle, low_barycentric, shading,
                                    hit_barycentric, normal_indices, normals, hit);
  const size_t plane = params.out_capacity;
  global float* to = result + first;
  if (whole) {
    vstore8(value.x, 0, to);
    vstore8(value.y, 0, to + plane);
    vstore8(value.z, 0, to + 2u * plane);
    return;
  }
  float x[8], y[8], z[8];
  vstore8(value.x, 0, x);
  vstore8(value.y, 0, y);
  vstore8(value.z, 0, z);
  for (uint i = 0u; i < params.count - first; ++i) {
    to[i] = x[i];
    to[i + plane] = y[i];
    to[i + 2u * plane] = z[i];
  }
}

/// With kiln_detail_resolve, for one sample a texel.
kernel void kiln_detail_texel_wide(const kiln_detail_params params,
                                   const kiln_resolve_params resolve,
                                   global const uint* restrict texel_index,
                                   global const uint* restrict low_triangle,
                                   global const float* restrict low_barycentric,
                                   global const kiln_low_shading* restrict shading,
                                   global const uint* restrict hit_triangle,
                                   global const float* restrict hit_barycentric,
                                   global const uint* restrict normal_indices,
                                   global const float* restrict normals,
                                   global float* restrict image,
                                   global uchar* restrict coverage) {
#pragma OPENCL FP_CONTRACT OFF
  const uint first = (uint)get_global_id(0) * 8u;
  if (first >= params.count) return;
  const uint8 lanes = detail_lanes(params, first);
  const bool whole = first + 8u <= params.count;
  const uint8 hit = wide_gather_uint(hit_triangle, lanes);
  wide3 value = detail_values(params, lanes, whole, low_triangle, low_barycentric, shading,
                              hit_barycentric, normal_indices, normals, hit);
  const int8 found = hit != KILN_NO_TRIANGLE;
  if (resolve.miss != KILN_MISS_KEEP) {
    const bool mark = resolve.miss == KILN_MISS_MARK;
    const wide3 missed = mark ? wide_of(1.0f, -1.0f, 1.0f) : wide_of(0.0f, 0.0f, 1.0f);
    value = wide_select(found, value, missed);
  }
  float x[8], y[8], z[8];
  int baked[8];
  vstore8(value.x, 0, x);
  vstore8(value.y, 0, y);
  vstore8(value.z, 0, z);
  vstore8(found, 0, baked);
  const uint count = min(8u, params.count - first);
  for (uint i = 0u; i < count; ++i) {
    const uint texel = texel_index[first + i];
    image[3u * (size_t)texel] = x[i];
    image[3u * (size_t)texel + 1u] = y[i];
    image[3u * (size_t)texel + 2u] = z[i];
    coverage[texel] = baked[i] != 0 ? 1 : 2;
  }
}
