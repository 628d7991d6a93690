// Generates and casts rays over hemispheres, and measures their lengths, in one kernel, by streams
// (accel/occlusion_block.clh).
//
// kernel                      global size                  local  per work-item
// kiln_hemisphere_cast_depth  samples / block_samples, up  1      reads 40 B a sample and the tree, 56 KB of its own
//
// Results are those of hemisphere.cl and ray.cl, bit by bit, as in hemisphere_cast.cl. Rays of a row have mixed
// directions, so beams do not help, and tracing them one by one takes six times as long. Limits: see occlusion.cl.
// Defines: KILN_BVH_PLAIN see accel/prism.clh

#define STREAM_CONES 1
#define STREAM_NEAREST 1
#include "accel/occlusion_block.clh"
#include "detail/hemisphere_fill.clh"

/// Adds the lengths of each sample's rays [first_ray, first_ray + rays), as kiln_hemisphere_sum_depths does.
/// \param query    ray parameters; capacity is KILN_OCCLUSION_BLOCK
/// \param scratch  per work-item: 6 planes of KILN_OCCLUSION_BLOCK
/// \param hits     per work-item: KILN_OCCLUSION_BLOCK
kernel void kiln_hemisphere_cast_depth(const kiln_hemisphere_params params,
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
                                       global float* hits,
                                       global float* restrict depth) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  const uint lane = item * cast.samples;
  if (lane >= params.stride) return;
  const uint samples = min(cast.samples, params.stride - lane);
  global float* rays = scratch + (size_t)item * (6 * KILN_OCCLUSION_BLOCK);
  global float* hit = hits + (size_t)item * KILN_OCCLUSION_BLOCK;
  global float* sums = depth + params.first + lane;
  const float8 reach = (float8)(params.reach);
  for (uint row = 0; row < params.rays; row += cast.rows) {
    const uint rows = min(cast.rows, params.rays - row);
    hemisphere_fill(params, points, turns, turn_table, directions, rings, lane, samples,
                    params.first_ray + row, rows, rays);
    occlusion_block(query, nodes, blocks, rays, 0, rows * samples, hit);
    for (uint i = 0; i < samples; i += LANES) {
      float8 sum = vload8(0, sums + i);
      for (uint k = 0; k < rows; ++k) {
        const float8 hit_distance = vload8(0, hit + k * samples + i);
        sum += select((float8)(1.0f), min(hit_distance, reach) / reach, hit_distance <= query.t_max);
      }
      vstore8(sum, 0, sums + i);
    }
  }
}
