// Generates, casts and counts rays over hemispheres in one kernel, by streams (accel/occlusion_block.clh).
//
// The kernels of hemisphere.cl pass rays through memory, 25 bytes each, written once and read three times. Here a
// work-item handles the rays of a few neighbouring samples, block by block; a block's data stays in a core's
// cache, and values common to a sample's rays are computed once per block.
//
// kernel                          global size                  local  per work-item
// kiln_hemisphere_cast            samples / block_samples, up  1      reads 40 B a sample and the tree; 48 KB of its own
// kiln_hemisphere_cast_by_sample  samples                      1      the same
//
// The second kernel is for few samples with many rays: a block holds rays of one sample. They start at one point,
// so that each stream, sorted by direction, is a narrow cone.
//
// Results are those of hemisphere.cl and occlusion.cl, bit by bit: the same rays, tests independent of the order,
// sums in the order of rows. Limits: drivers that map work-items to lanes, see occlusion.cl. Defines:
// KILN_BVH_PLAIN  see accel/prism.clh

#define STREAM_CONES 1
#include "accel/occlusion_block.clh"
#include "detail/hemisphere_fill.clh"

/// Adds each sample's number of rays without a hit. \param bent_sum receives the sums of their directions;
/// may be null
/// \param unequal  as in kiln_hemisphere_params
static inline void hemisphere_sum(uint unequal, uint samples, uint rows, global const float* rays,
                                  global const uchar* hit, global uint* open, global float* bent_sum,
                                  size_t bent_sum_plane) {
#pragma OPENCL FP_CONTRACT OFF
  for (uint i = 0; i < samples; i += LANES) {
    uint8 count = vload8(0, open + i);
    float8 sum[3];
    for (int axis = 0; axis < 3 && bent_sum != 0; ++axis) {
      sum[axis] = vload8(0, bent_sum + i + axis * bent_sum_plane);
    }
    for (uint row = 0; row < rows; ++row) {
      const uint at = row * samples + i;
      const uint8 open_rays = 1u - convert_uint8(vload8(0, hit + at));
      count += open_rays;
      if (bent_sum == 0) continue;
      float8 share = convert_float8(open_rays), direction[3];
      for (int axis = 0; axis < 3; ++axis) {
        direction[axis] = vload8(0, rays + at + (3 + axis) * KILN_OCCLUSION_BLOCK);
      }
      if (unequal != 0u) share *= hemisphere_per_length(direction);
      for (int axis = 0; axis < 3; ++axis) sum[axis] -= share * direction[axis];
    }
    vstore8(count, 0, open + i);
    for (int axis = 0; axis < 3 && bent_sum != 0; ++axis) {
      vstore8(sum[axis], 0, bent_sum + i + axis * bent_sum_plane);
    }
  }
}

/// Casts rays [first_ray, first_ray + rays) of samples [first, first + stride).
/// \param query    ray parameters; capacity is KILN_OCCLUSION_BLOCK
/// \param scratch  per work-item: 6 planes of KILN_OCCLUSION_BLOCK
/// \param hits     per work-item: KILN_OCCLUSION_BLOCK
/// \param bent_sum     accessed only if wants_bent_sum is 1
static KILN_CALL void hemisphere_cast(const uint item, const kiln_hemisphere_params params,
                                      const kiln_ray_params query, const kiln_cast_params cast,
                                      global const kiln_bvh_node* KILN_CALL_RESTRICT nodes,
                                      global const kiln_bvh_block* KILN_CALL_RESTRICT blocks,
                                      global const float* KILN_CALL_RESTRICT points,
                                      global const uint* KILN_CALL_RESTRICT turns,
                                      global const float* KILN_CALL_RESTRICT turn_table,
                                      global const float* KILN_CALL_RESTRICT directions,
                                      global const uint* KILN_CALL_RESTRICT rings,
                                      global float* scratch, global uchar* hits,
                                      global uint* KILN_CALL_RESTRICT open,
                                      global float* KILN_CALL_RESTRICT bent_sum) {
  const uint lane = item * cast.samples;
  if (lane >= params.stride) return;
  const uint samples = min(cast.samples, params.stride - lane);
  global float* rays = scratch + (size_t)item * (6 * KILN_OCCLUSION_BLOCK);
  global uchar* hit = hits + (size_t)item * KILN_OCCLUSION_BLOCK;
  const size_t sums = params.first + lane;
  for (uint row = 0; row < params.rays; row += cast.rows) {
    const uint rows = min(cast.rows, params.rays - row);
    hemisphere_fill(params, points, turns, turn_table, directions, rings, lane, samples,
                    params.first_ray + row, rows, rays);
    occlusion_block(query, nodes, blocks, rays, 0, rows * samples, hit);
    hemisphere_sum(params.unequal, samples, rows, rays, hit, open + sums, cast.wants_bent_sum != 0u ? bent_sum + sums : 0,
                   params.out_capacity);
  }
}

kernel void kiln_hemisphere_cast(const kiln_hemisphere_params params,
                                 const kiln_ray_params query,
                                 const kiln_cast_params cast,
                                 global const kiln_bvh_node* restrict nodes,
                                 global const kiln_bvh_block* restrict blocks,
                                 global const float* restrict points,
                                 global const uint* restrict turns,
                                 global const float* restrict turn_table,
                                 global const float* restrict directions,
                                 global const uint* restrict rings,
                                 global float* scratch,
                                 global uchar* hits,
                                 global uint* restrict open,
                                 global float* restrict bent_sum) {
  hemisphere_cast((uint)get_global_id(0), params, query, cast, nodes, blocks, points, turns,
                  turn_table, directions, rings, scratch, hits, open, bent_sum);
}

/// Generates rays [first_row, first_row + rows) of one sample, in the order of the ray set. Unlike hemisphere_fill(),
/// it does not begin each ring at another ray: that only aligns the directions of rows that hold rays of many samples.
static KILN_CALL void hemisphere_fill_by_sample(const kiln_hemisphere_params params,
                                          global const float* point, uint code,
                                          global const float* turn_table,
                                          global const float* directions, uint first_row,
                                          uint rows, global float* rays) {
  hemisphere_lanes lanes;
  hemisphere_load(params, point, true, (uint8)(code), turn_table, &lanes);
  const uint total_rays = params.all_rays;
  global const float* set_directions = directions + lanes.set.s0 * (3 * total_rays) + first_row;
  for (uint i = 0; i < rows; i += LANES) {
    const uint first_ray = min(i, rows - LANES);  // the last rays may be generated twice
    float8 disk[3];
    KILN_UNROLL
    for (int axis = 0; axis < 3; ++axis) disk[axis] = vload8(0, set_directions + axis * total_rays + first_ray);
    float8 origin[3], opposite[3];
    hemisphere_rotate(params, &lanes, disk, origin, opposite);
    KILN_UNROLL
    for (int axis = 0; axis < 3; ++axis) {
      vstore8(origin[axis], 0, rays + axis * KILN_OCCLUSION_BLOCK + first_ray);
      vstore8(opposite[axis], 0, rays + (3 + axis) * KILN_OCCLUSION_BLOCK + first_ray);
    }
  }
}

/// Casts rays [first_ray, first_ray + rays), 64 or more, of samples [first, first + count).
/// \param query, scratch, hits  as for kiln_hemisphere_cast
static KILN_CALL void hemisphere_cast_by_sample(const uint item, const kiln_hemisphere_params params,
                                          const kiln_ray_params query,
                                          global const kiln_bvh_node* KILN_CALL_RESTRICT nodes,
                                          global const kiln_bvh_block* KILN_CALL_RESTRICT blocks,
                                          global const float* KILN_CALL_RESTRICT points,
                                          global const uint* KILN_CALL_RESTRICT turns,
                                          global const float* KILN_CALL_RESTRICT turn_table,
                                          global const float* KILN_CALL_RESTRICT directions,
                                          global float* scratch, global uchar* hits,
                                          global uint* KILN_CALL_RESTRICT open) {
  if (item >= params.count) return;
  global float* rays = scratch + (size_t)item * (6 * KILN_OCCLUSION_BLOCK);
  global uchar* hit = hits + (size_t)item * KILN_OCCLUSION_BLOCK;
  uint open_rays = 0;
  const uint block_count = (params.rays + KILN_OCCLUSION_BLOCK - 1) / KILN_OCCLUSION_BLOCK;
  const uint block = (params.rays + block_count - 1) / block_count;
  for (uint row = 0; row < params.rays; row += block) {
    const uint rows = min(block, params.rays - row);
    hemisphere_fill_by_sample(params, points + params.first_point + item, turns[params.first + item],
                        turn_table, directions, params.first_ray + row, rows, rays);
    occlusion_block(query, nodes, blocks, rays, 0, rows, hit);
    for (uint i = 0; i < rows; ++i) open_rays += 1u - hit[i];
  }
  open[params.first + item] += open_rays;
}

kernel void kiln_hemisphere_cast_by_sample(const kiln_hemisphere_params params,
                                           const kiln_ray_params query,
                                           global const kiln_bvh_node* restrict nodes,
                                           global const kiln_bvh_block* restrict blocks,
                                           global const float* restrict points,
                                           global const uint* restrict turns,
                                           global const float* restrict turn_table,
                                           global const float* restrict directions,
                                           global float* scratch,
                                           global uchar* hits,
                                           global uint* restrict open) {
  hemisphere_cast_by_sample((uint)get_global_id(0), params, query, nodes, blocks, points, turns,
                      turn_table, directions, scratch, hits, open);
}
