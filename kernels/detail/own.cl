// User-defined maps: gathers each sample's point and calls the user's function.
//
// The user's source follows this file in the program, so it can use the declarations of own.clh. Of
// the user's source this file uses only kiln_map().
//
// kernel             global   local  memory traffic an item
// kiln_own_evaluate  samples  64     reads 41 B + 2 triangles (gathered), writes 16 B; and the reads of kiln_map()
//
// Defines: none. Strengths: any map that a formula defines, without another pass over the match. Limits: a
// function that never returns blocks its launch (at most 65,536 samples), since nothing on the device can
// interrupt it.

#include "detail/detail.clh"
#include "detail/own.clh"

static inline float3 own_normalize(float3 v, float3 fallback) {
#pragma OPENCL FP_CONTRACT OFF
  const float largest = max(fabs(v.x), max(fabs(v.y), fabs(v.z)));
  if (!(largest > 1e-30f)) return fallback;
  const float3 scaled = v / largest;
  return scaled / sqrt(dot3(scaled, scaled));
}

/// Computes the values of samples [first, end) as four planes. Samples without a point get 0.
/// \param low_points  position (frame units) and direction, planes
/// \param uvs         per corner index if has_uvs; u and v interleaved
kernel void kiln_own_evaluate(const kiln_user_map_params params,
                              global const uint* restrict low_triangle,
                              global const float* restrict low_barycentric,
                              global const float* restrict low_points,
                              global const kiln_low_shading* restrict shading,
                              global const uint* restrict hit_triangle,
                              global const float* restrict hit_barycentric,
                              global const float* restrict hit_distance,
                              global const uchar* restrict hit_status,
                              global const float* restrict positions,
                              global const uint* restrict triangles,
                              global const uint* restrict normal_indices,
                              global const float* restrict normals,
                              global const float* restrict uvs,
                              global const uint* restrict uv_triangles,
                              global const kiln_bvh_node* restrict nodes,
                              global const kiln_bvh_block* restrict blocks,
                              global float* restrict values) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t s = params.first + get_global_id(0);
  if (s >= params.end) return;
  const size_t plane = params.out_capacity;
  const uint triangle = hit_triangle[s];
  float4 value = (float4)(0.0f);
  if (triangle != KILN_NO_TRIANGLE) {
    kiln_scene scene;
    scene.nodes = nodes;
    scene.blocks = blocks;
    scene.center = (float3)(params.center_x, params.center_y, params.center_z);
    scene.scale = params.scale;
    kiln_detail_params detail = {0};
    detail.two_sided = params.two_sided;
    const detail_low low =
        detail_read_low(detail, shading + low_triangle[s], low_barycentric[s],
                        low_barycentric[s + params.low_capacity]);
    const float u = hit_barycentric[s];
    const float v = hit_barycentric[s + params.hit_capacity];
    const uint3 corner = vload3(triangle, triangles);
    const float3 a = vload3(corner.x, positions);
    const float3 ab = vload3(corner.y, positions) - a;
    const float3 ac = vload3(corner.z, positions) - a;
    const size_t low_plane = params.low_capacity;
    const float3 low_at =
        (float3)(low_points[s], low_points[s + low_plane], low_points[s + 2 * low_plane]);
    kiln_point point;
    point.position = ((a + ab * u) + ac * v) / params.scale + scene.center;
    point.normal = detail_source_normal(detail, low, triangle, u, v, normal_indices, normals);
    point.face_normal = own_normalize(
        cross3(own_normalize(ab, (float3)(0.0f)), own_normalize(ac, (float3)(0.0f))), point.normal);
    point.low_position = low_at / params.scale + scene.center;
    point.low_normal = own_normalize(low.normal, low.face_normal);
    point.barycentric = (float3)(1.0f - u - v, u, v);
    point.uv = (float2)(0.0f);
    if (params.has_uvs != 0u) {
      const uint3 at = vload3(triangle, uv_triangles);
      point.uv = (vload2(at.x, uvs) * point.barycentric.x + vload2(at.y, uvs) * u) +
                 vload2(at.z, uvs) * v;
    }
    point.distance = params.has_match != 0u ? hit_distance[s] / params.scale : 0.0f;
    point.provenance = params.has_match != 0u ? hit_status[s] : 0u;
    point.triangle = triangle;
    point.low_triangle = low_triangle[s];
    point.scene = &scene;
    value = kiln_map(&point);
  }
  values[s] = value.x;
  values[s + plane] = value.y;
  values[s + 2 * plane] = value.z;
  values[s + 3 * plane] = value.w;
}
