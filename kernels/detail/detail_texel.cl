// Detail at one sample a texel: normals at the corresponding points, written to their texels in one pass.
//
// The kernel does the work of kiln_detail_compute_normals and kiln_detail_resolve of detail.cl, which explains the method, without
// the intermediate values. It is a program of its own, since most bakes need no other kernel of detail.cl.
//
// -D           range  default
// KILN_WIDTH   1, 8   1
//
// kernel                   global            local  memory traffic a sample
// kiln_detail_bake_texels  samples / width   64     reads 33 B + 2 triangles' attributes (gathered), writes 13 B
//
// Strengths: half the memory traffic of two passes. Limits: barycentric interpolation only.

#include "detail/detail_group.clh"
#include "lib/call.clh"

/// Normals and texels in one pass for one sample per texel: kiln_detail_compute_normals and
/// kiln_detail_resolve without the intermediate values.
static KILN_CALL void detail_bake_texels(const lanes_range at, const kiln_detail_params params,
                                         const kiln_resolve_params resolve,
                                         global const uint* KILN_CALL_RESTRICT texel_index,
                                         global const uint* KILN_CALL_RESTRICT low_triangle,
                                         global const float* KILN_CALL_RESTRICT low_barycentric,
                                         global const kiln_low_shading* KILN_CALL_RESTRICT shading,
                                         global const uint* KILN_CALL_RESTRICT hit_triangle,
                                         global const float* KILN_CALL_RESTRICT hit_barycentric,
                                         global const uint* KILN_CALL_RESTRICT normal_indices,
                                         global const float* KILN_CALL_RESTRICT normals,
                                         global float* KILN_CALL_RESTRICT image, global uchar* KILN_CALL_RESTRICT coverage) {
  const lanes_uint hit = lanes_load_uint(hit_triangle, at);
  const detail_group group =
      detail_read_group(params, at, low_triangle, low_barycentric, shading, hit, hit_barycentric,
                        normal_indices, normals);
  lanes3 value = detail_to_map(params, group.low, group.normal);
  const lanes_int found = hit != (lanes_uint)(KILN_NO_TRIANGLE);
  if (resolve.miss == KILN_MISS_MARK) {
    value = lanes3_select(found, value, lanes3_of(1.0f, -1.0f, 1.0f));
  } else if (resolve.miss != KILN_MISS_KEEP) {
    value = lanes3_select(found, value, lanes3_of(0.0f, 0.0f, 1.0f));
  }
  float x[KILN_WIDTH], y[KILN_WIDTH], z[KILN_WIDTH];
  int baked[KILN_WIDTH];
  lanes_store(value.x, x);
  lanes_store(value.y, y);
  lanes_store(value.z, z);
  lanes_store(found, baked);
  for (uint i = 0u; i < at.count; ++i) {
    const uint texel = texel_index[at.first + i];
    image[3u * (size_t)texel] = x[i];
    image[3u * (size_t)texel + 1u] = y[i];
    image[3u * (size_t)texel + 2u] = z[i];
    coverage[texel] = baked[i] != 0 ? 1 : 2;
  }
}

kernel void kiln_detail_bake_texels(const kiln_detail_params params,
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
  const lanes_range at = lanes_of_item(params.count);
  if (at.count == 0u) return;
  detail_bake_texels(at, params, resolve, texel_index, low_triangle, low_barycentric, shading,
                     hit_triangle, hit_barycentric, normal_indices, normals, image, coverage);
}
