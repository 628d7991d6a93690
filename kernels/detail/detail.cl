// Detail: normals at the corresponding points, and averaging of samples to texels.
//
// Normals of the high poly are interpolated at the matched point and expressed in the low poly's frame: MikkTSpace's
// tangent frame (Mikkelsen 2008), the axes of object space, or the face's own frame (Wang, Froehlich, Goebel, "Fast
// Normal Map Generation for Simplified Meshes", section 3). The tangent frame is interpolated and not normalised, as
// in shaders, and inverted exactly: decoding with x * T + y * B + z * N restores the direction of the high poly's
// normal.
//
// One source is built for 1 sample a work-item (GPUs) or 8 (CPUs). PoCL vectorises across work-items only if
// a kernel has neither branches nor gathers, and these kernels have both; so lib/lanes.clh writes vectors
// out. The same operations run in the same order in each lane, so both widths give the same bits.
//
// -D           range  default
// KILN_WIDTH   1, 8   1
//
// kernel                       global           local  memory traffic a sample (resolve: a texel)
// kiln_detail_compute_normals  samples / width  64     reads 29 B + 2 triangles' attributes (gathered), writes 12 B
// kiln_detail_blend            samples / width  64     the same, and of the other match 16 B + 2 triangles' attributes
// kiln_detail_resolve          texels           64     reads 12 B + 13 B a sample, writes 13 B (scattered)
//
// Neighbouring samples mostly lie in one triangle of the low poly: eight samples of one triangle share one read of
// its attributes. The high poly's normals and their indices are read four numbers at a time, so both arrays have one
// padding element.
//
// Bakes with one sample a texel use the kernel of detail_texel.cl instead of these. Limits: barycentric interpolation
// only.

#include "detail/detail_group.clh"
#include "lib/call.clh"

static KILN_CALL void detail_compute_normals(const lanes_range at, const kiln_detail_params params,
                                             global const uint* KILN_CALL_RESTRICT low_triangle,
                                             global const float* KILN_CALL_RESTRICT low_barycentric,
                                             global const kiln_low_shading* KILN_CALL_RESTRICT shading,
                                             global const uint* KILN_CALL_RESTRICT hit_triangle,
                                             global const float* KILN_CALL_RESTRICT hit_barycentric,
                                             global const uint* KILN_CALL_RESTRICT normal_indices,
                                             global const float* KILN_CALL_RESTRICT normals,
                                             global float* KILN_CALL_RESTRICT result) {
  const lanes_uint hit = lanes_load_uint(hit_triangle, at);
  const detail_group group =
      detail_read_group(params, at, low_triangle, low_barycentric, shading, hit, hit_barycentric,
                        normal_indices, normals);
  detail_store(detail_to_map(params, group.low, group.normal), at, params.out_capacity, result);
}

kernel void kiln_detail_compute_normals(const kiln_detail_params params,
                                        global const uint* restrict low_triangle,
                                        global const float* restrict low_barycentric,
                                        global const kiln_low_shading* restrict shading,
                                        global const uint* restrict hit_triangle,
                                        global const float* restrict hit_barycentric,
                                        global const uint* restrict normal_indices,
                                        global const float* restrict normals,
                                        global float* restrict result) {
  const lanes_range at = lanes_of_item(params.count);
  if (at.count == 0u) return;
  detail_compute_normals(at, params, low_triangle, low_barycentric, shading, hit_triangle, hit_barycentric,
                         normal_indices, normals, result);
}

/// Blends the normals of two correspondences for samples where the second one has a triangle.
/// \param shares weight of the first correspondence, per sample
static KILN_CALL void detail_blend(const lanes_range at, const kiln_detail_params params,
                                   const uint other_capacity,
                                   global const uint* KILN_CALL_RESTRICT low_triangle,
                                   global const float* KILN_CALL_RESTRICT low_barycentric,
                                   global const kiln_low_shading* KILN_CALL_RESTRICT shading,
                                   global const uint* KILN_CALL_RESTRICT hit_triangle,
                                   global const float* KILN_CALL_RESTRICT hit_barycentric,
                                   global const uint* KILN_CALL_RESTRICT other_triangle,
                                   global const float* KILN_CALL_RESTRICT other_barycentric,
                                   global const float* KILN_CALL_RESTRICT shares,
                                   global const uint* KILN_CALL_RESTRICT normal_indices,
                                   global const float* KILN_CALL_RESTRICT normals,
                                   global float* KILN_CALL_RESTRICT result) {
#pragma OPENCL FP_CONTRACT OFF
  const lanes_uint hit = lanes_load_uint(hit_triangle, at);
  const detail_group group =
      detail_read_group(params, at, low_triangle, low_barycentric, shading, hit, hit_barycentric,
                        normal_indices, normals);
  const lanes_uint triangle = lanes_load_uint(other_triangle, at);
  const lanes_int is_blended = triangle != (lanes_uint)(KILN_NO_TRIANGLE);
  lanes3 normal = group.normal;
  if (lanes_any(is_blended)) {
    const lanes_float u = lanes_load(other_barycentric, at);
    const lanes_float v = lanes_load(other_barycentric + other_capacity, at);
    const lanes3 other =
        detail_source_normal(params, group.low, triangle, u, v, normal_indices, normals);
    const lanes_float share = lanes_load(shares, at);
    const lanes_float other_share = 1.0f - share;
    lanes3 mixed;
    mixed.x = normal.x * share + other.x * other_share;
    mixed.y = normal.y * share + other.y * other_share;
    mixed.z = normal.z * share + other.z * other_share;
    normal = lanes3_select(is_blended, detail_normalize(mixed, normal), normal);
  }
  detail_store(detail_to_map(params, group.low, normal), at, params.out_capacity, result);
}

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
  const lanes_range at = lanes_of_item(params.count);
  if (at.count == 0u) return;
  detail_blend(at, params, other_capacity, low_triangle, low_barycentric, shading, hit_triangle,
               hit_barycentric, other_triangle, other_barycentric, shares, normal_indices, normals,
               result);
}

#if KILN_WIDTH == 1
/// Averages a texel's samples, and normalises if there are several. Writes three interleaved floats and a
/// coverage byte (1 baked, 2 missed) at the texel's index in the band.
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
  uint hit_count = 0u;
  for (uint s = begin; s < end; ++s) {
    const bool hit = hit_triangle[s] != KILN_NO_TRIANGLE;
    hits += hit ? 1u : 0u;
    if (!hit && params.miss != KILN_MISS_KEEP) continue;
    const float3 value = (float3)(values[s], values[s + capacity], values[s + 2 * capacity]);
    if (hit_count == 0u) first_value = value;
    sum += value;
    ++hit_count;
  }
  float3 value = hit_count == 1u ? first_value : detail_normalize(sum, first_value);
  if (hit_count == 0u) {
    value = params.miss == KILN_MISS_MARK ? (float3)(1.0f, -1.0f, 1.0f) : (float3)(0.0f, 0.0f, 1.0f);
  }
  const uint texel = texel_index[i];
  vstore3(value, texel, image);
  coverage[texel] = hits != 0u ? 1 : 2;
}
#endif
