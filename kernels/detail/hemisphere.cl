// Hemispheres: rays from the high poly's matched points, with their hits summed for each sample.
//
// Ambient occlusion is the share of cosine-weighted rays over the hemisphere about the normal that hit nothing
// (Zhukov, Iones, Kronin, "An Ambient Light Illumination Model", 1998); the mean of the open ones is the bent
// normal (Landis, "Production-Ready Global Illumination", 2002). Rays of a sample are a spiral on the disk (Vogel
// 1979), lifted to the hemisphere, which weights them by the cosine. Samples share a few such sets, rotated about
// the normal; the set and the angle are a hash of the sample's position in the map. The basis about a normal is
// continuous almost everywhere (Duff et al., "Building an Orthonormal Basis, Revisited", 2017).
//
// A row of rays holds one ray of each sample, so rays that are neighbours in memory start near each other. The rays of
// a row also have similar directions, despite the rotations: the set is cut into rings, each sorted by angle, and a
// rotated sample starts at another ray of the ring. This only changes the order of a sample's rays. For nearest hits
// rows have mixed directions, since beams of rays that diverge widen until they reach all nodes. If few samples, far
// apart, cast many rays each, the rays of a row share no nodes; then the rays of one sample are consecutive instead
// (by_sample). Origins are offset along the geometric normal (by `push`), to the side of the ray, so that no ray hits
// the face that it starts from.
//
// kernel                                global       local  memory traffic an item
// kiln_hemisphere_gather                samples      64     reads 44 B (gathered), writes 40 B
// kiln_hemisphere_renew_rotations       samples      64     reads 8 B (gathered), writes 4 B
// kiln_hemisphere_write_rays            rays / 8     64     reads 320 B + 8 directions (gathered), writes 192 B
// kiln_hemisphere_count_open            samples / 8  8      reads 8 B a row of rays, writes 32 B
// kiln_hemisphere_count_open_by_sample  samples      64     reads 4 B + 1 B a ray, writes 4 B
// kiln_hemisphere_sum_directions        samples / 8  8      reads 104 B a row of rays, writes 96 B
// kiln_hemisphere_sum_depths            samples / 8  8      reads 64 B a row of rays, writes 32 B
// kiln_hemisphere_write_bent            samples      64     reads 41 B + 2 triangles' attributes, writes 12 B
//
// Their origins come from hemisphere_points.cl, a program of its own: CPUs pass them to hemisphere_cast.cl, and most
// bakes there need no kernel of this file. Strengths: sums have a fixed order, so that they depend on the sample alone.
// Limits: occluders nearer than the offset of the origins are missed.

#include "detail/detail.clh"
#include "detail/hemisphere_ray.clh"
#include "detail/hemisphere_turn.clh"

/// Copies the inputs of selected samples' rays from a band into compact arrays.
kernel void kiln_hemisphere_gather(
    const kiln_pick_params params, global const uint* restrict samples,
    global const uint* restrict low_triangle, global const float* restrict low_barycentric,
    global const float* restrict low_points, global const uint* restrict hit_triangle,
    global const float* restrict hit_barycentric,
    // rotations, or keys (params.by_key)
    global const uint* restrict turns, global uint* restrict to_low_triangle,
    global float* restrict to_low_barycentric, global float* restrict to_points,
    global uint* restrict to_hit_triangle, global float* restrict to_hit_barycentric,
    global uint* restrict to_turns) {
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t s = samples[i];
  const size_t plane = params.out_capacity;
  to_low_triangle[i] = low_triangle[s];
  to_hit_triangle[i] = hit_triangle[s];
  for (size_t p = 0; p < 2; ++p) {
    to_low_barycentric[i + p * plane] = low_barycentric[s + p * params.low_capacity];
    to_hit_barycentric[i + p * plane] = hit_barycentric[s + p * params.hit_capacity];
  }
  for (size_t p = 0; p < 3; ++p) {
    to_points[i + p * plane] = low_points[s + p * params.low_capacity];
  }
  to_turns[i] = params.by_key != 0u ? hemisphere_turn(turns[s], params.round) : turns[s];
}

/// Computes new rotations about the normals of the same samples, for another round of rays.
kernel void kiln_hemisphere_renew_rotations(const kiln_pick_params params,
                                            global const uint* restrict samples,
                                            global const uint* restrict keys,
                                            global uint* restrict to_turns) {
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  to_turns[i] = hemisphere_turn(keys[samples[i]], params.round);
}

/// Rays [first_ray, first_ray + rays) of samples [first, first + stride), one row per ray: position
/// and direction. With by_sample, the rays of each sample are consecutive. The stored direction is
/// the ray's opposite, since front faces have normals along it.
/// \param turn_table  cosines, then sines
/// \param directions  per set: x, y and z on the hemisphere, one plane each
/// \param rings       per ray: the ring's first ray, then its number of rays, one plane each
kernel void kiln_hemisphere_write_rays(const kiln_hemisphere_params params,
                                       global const float* restrict points,
                                       global const uint* restrict turns,
                                       global const float* restrict turn_table,
                                       global const float* restrict directions,
                                       global const uint* restrict rings, global float* restrict rays) {
#pragma OPENCL FP_CONTRACT OFF
  // A work-item handles one ray of each of 8 samples, or 8 rays of one sample.
  const bool by_sample = params.by_sample != 0u;
  const uint groups = by_sample ? (params.rays + LANES - 1) / LANES : params.stride / LANES;
  const uint item = (uint)get_global_id(0);
  if (item >= groups * (by_sample ? params.stride : params.rays)) return;
  const uint outer_index = item / groups;
  const uint inner_index = (item - outer_index * groups) * LANES;
  const uint first_row = by_sample ? inner_index : outer_index;
  const uint lane = by_sample ? outer_index : inner_index;
  const uint total_rays = params.all_rays;
  uint8 row = (uint8)(params.first_ray + first_row);
  uint8 ring_first = (uint8)(rings[params.first_ray + first_row]);
  uint8 ring_size = (uint8)(rings[params.first_ray + first_row + total_rays]);
  uint8 code;
  if (by_sample) {
    uint rows[LANES], firsts[LANES], sizes[LANES];
    for (uint k = 0; k < LANES; ++k) {
      rows[k] = params.first_ray + min(first_row + k, params.rays - 1);
      firsts[k] = rings[rows[k]];
      sizes[k] = rings[rows[k] + total_rays];
    }
    row = vload8(0, rows);
    ring_first = vload8(0, firsts);
    ring_size = vload8(0, sizes);
    code = (uint8)(turns[params.first + lane]);
  } else {
    code = vload8(0, turns + params.first + lane);
  }
  hemisphere_lanes lanes;
  hemisphere_load(params, points + params.first_point + lane, by_sample, code, turn_table, &lanes);
  float8 origin[3], opposite[3];
  hemisphere_ray(params, &lanes, row, ring_first, ring_size, directions, origin, opposite);
  const size_t plane = params.ray_capacity;
  global float* target = rays + (by_sample ? (size_t)lane * params.rays + first_row
                                           : (size_t)first_row * params.stride + lane);
  const uint ray_count = by_sample ? params.rays - first_row : LANES;
  for (int axis = 0; axis < 3; ++axis) {
    if (ray_count >= LANES) {
      vstore8(origin[axis], 0, target + axis * plane);
      vstore8(opposite[axis], 0, target + (3 + axis) * plane);
      continue;
    }
    float origins[LANES], direction_values[LANES];
    vstore8(origin[axis], 0, origins);
    vstore8(opposite[axis], 0, direction_values);
    for (uint k = 0; k < ray_count; ++k) {
      target[k + axis * plane] = origins[k];
      target[k + (3 + axis) * plane] = direction_values[k];
    }
  }
}

/// Body of the kernels that sum over rows of rays. It computes `planes` sums for each sample of the work-item. `add` is
/// the statement that adds a row's values, from index `at` on, to sum[].
#define HEMISPHERE_ADD_ROWS(vector, planes, result, add)                 \
  const uint lane = (uint)get_global_id(0) * LANES;                      \
  if (lane >= params.stride) return;                                     \
  const size_t result_plane = params.out_capacity;                       \
  vector sum[planes];                                                    \
  for (int p = 0; p < planes; ++p) {                                     \
    sum[p] = vload8(0, result + params.first + lane + p * result_plane); \
  }                                                                      \
  for (uint row = 0; row < params.rays; ++row) {                         \
    const size_t at = (size_t)row * params.stride + lane;                \
    add                                                                  \
  }                                                                      \
  for (int p = 0; p < planes; ++p) {                                     \
    vstore8(sum[p], 0, result + params.first + lane + p * result_plane); \
  }

/// Adds each sample's number of rays without a hit.
kernel void kiln_hemisphere_count_open(const kiln_hemisphere_params params,
                                       global const uchar* restrict hit, global uint* restrict open){
    HEMISPHERE_ADD_ROWS(uint8, 1, open, { sum[0] += 1u - convert_uint8(vload8(0, hit + at)); })}

/// Adds each sample's number of rays without a hit, for params.by_sample = 1.
kernel void kiln_hemisphere_count_open_by_sample(const kiln_hemisphere_params params,
                                                 global const uchar* restrict hit, global uint* restrict open) {
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  global const uchar* hits_of_sample = hit + i * params.rays;
  uint hits = 0;
  for (uint ray = 0; ray < params.rays; ++ray) hits += hits_of_sample[ray];
  open[params.first + i] += params.rays - hits;
}

/// Adds each sample's number of rays towards the light without a hit. Samples that face away from the light
/// have no rays, and count as unlit.
kernel void kiln_hemisphere_count_lit(const kiln_hemisphere_params params,
                                      global const uchar* restrict hit, global const float* restrict rays,
                                      global uint* restrict lit) {
  const size_t plane = params.ray_capacity;
  global const float* directions = rays + 3 * plane;
  HEMISPHERE_ADD_ROWS(uint8, 1, lit, {
    const int8 has_ray = (vload8(0, directions + at) != 0.0f) |
                         (vload8(0, directions + plane + at) != 0.0f) |
                         (vload8(0, directions + 2 * plane + at) != 0.0f);
    sum[0] += select((uint8)(0u), 1u - convert_uint8(vload8(0, hit + at)), has_ray);
  })
}

/// Adds each sample's sum of directions of rays without a hit.
kernel void kiln_hemisphere_sum_directions(const kiln_hemisphere_params params,
                                           global const uchar* restrict hit,
                                           global const float* restrict rays,
                                           global float* restrict bent_sum) {
#pragma OPENCL FP_CONTRACT OFF
  global const float* directions = rays + 3 * (size_t)params.ray_capacity;
  HEMISPHERE_ADD_ROWS(float8, 3, bent_sum, {
    float8 open = 1.0f - convert_float8(vload8(0, hit + at));
    float8 direction[3];
    for (int axis = 0; axis < 3; ++axis) {
      direction[axis] = vload8(0, directions + axis * (size_t)params.ray_capacity + at);
    }
    if (params.unequal != 0u) open *= hemisphere_per_length(direction);
    for (int axis = 0; axis < 3; ++axis) sum[axis] -= open * direction[axis];
  })
}

/// Adds each sample's sum of hit distances, each as a share of `reach`, at most 1.
kernel void kiln_hemisphere_sum_depths(const kiln_hemisphere_params params,
                                       global const uint* restrict triangle,
                                       global const float* restrict distance,
                                       global float* restrict depth) {
#pragma OPENCL FP_CONTRACT OFF
  const float8 reach = (float8)(params.reach);
  HEMISPHERE_ADD_ROWS(float8, 1, depth, {
    const int8 found = vload8(0, triangle + at) != (uint8)(KILN_NO_TRIANGLE);
    const float8 hit_distance = min(fabs(vload8(0, distance + at)), reach) / reach;
    sum[0] += select((float8)(1.0f), hit_distance, found);
  })
}

/// Computes the mean unoccluded direction; the normal if all rays have a hit.
static inline float3 hemisphere_compute_bent(const kiln_detail_params params, const detail_low low,
                                             uint triangle, global const float* barycentric, uint capacity,
                                             global const float* bent_sum, size_t i,
                                             global const uint* normal_indices,
                                             global const float* normals) {
  const float3 normal = detail_source_normal(params, low, triangle, barycentric[i],
                                             barycentric[i + capacity], normal_indices, normals);
  const size_t plane = params.out_capacity;
  return detail_normalize((float3)(bent_sum[i], bent_sum[i + plane], bent_sum[i + 2 * plane]), normal);
}

/// Writes bent normals in the map's space. Where a sample has a triangle in the second correspondence, too, its bent
/// normals of both correspondences are blended.
/// \param other_capacity  of the second correspondence; 0 if there is none
/// \param shares weight of the first correspondence, per sample
kernel void kiln_hemisphere_write_bent(
    const kiln_detail_params params, const uint other_capacity,
    global const uint* restrict low_triangle, global const float* restrict low_barycentric,
    global const kiln_low_shading* restrict shading, global const uint* restrict hit_triangle,
    global const float* restrict hit_barycentric, global const float* restrict bent_sum,
    global const uint* restrict other_triangle, global const float* restrict other_barycentric,
    global const float* restrict other_bent_sum, global const float* restrict shares,
    global const uint* restrict normal_indices, global const float* restrict normals,
    global float* restrict result) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const detail_low low = detail_read_low(params, shading + low_triangle[i], low_barycentric[i],
                                         low_barycentric[i + params.low_capacity]);
  float3 bent = hemisphere_compute_bent(params, low, hit_triangle[i], hit_barycentric, params.hit_capacity,
                                        bent_sum, i, normal_indices, normals);
  if (other_capacity != 0u && other_triangle[i] != KILN_NO_TRIANGLE) {
    const float3 other =
        hemisphere_compute_bent(params, low, other_triangle[i], other_barycentric, other_capacity,
                                other_bent_sum, i, normal_indices, normals);
    const float share = shares[i];
    bent = detail_normalize(bent * share + other * (1.0f - share), bent);
  }
  detail_store_planes(detail_to_map(params, low, bent), i, params.out_capacity, result);
}
