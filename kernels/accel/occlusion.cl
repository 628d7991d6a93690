// Any-hit queries: finds whether each ray hits a triangle. The first hit found ends the traversal; otherwise see
// ray.cl.
//
// Rays of ambient occlusion start beside each other but run in all directions. So a work-item sorts a
// block of samples by the signs of their directions and the dominant axis, and traverses the tree with up
// to 64 of them at a time (stream.clh).
//
// | kernel                    | global size        | local | reads, writes a sample           |
// | kiln_occlusion_any_stream | samples / 2048, up | 4     | 48 B (56 with reach) + tree, 1 B |
// | kiln_occlusion_any_wide   | samples            | 64    | 24 B (28 with reach) + tree, 1 B |
// | kiln_occlusion_any_scalar | samples            | 64    | the same                         |
//
// The stream's local size is small, since a work-item handles 2048 samples: with larger work-groups,
// too few of them would remain to balance the load.
//
// Defines: KILN_RAY_SCALAR, KILN_PORTABLE_MASKS  as in ray.cl
//          KILN_RAY_SINGLE  build the wide kernel instead of the stream: for CPU drivers that turn
//                           work-items into lanes. llvmpipe compiles the stream for over a minute, and
//                           incorrectly.
//          KILN_BVH_PLAIN   see prism.clh
// Limits: see ray.cl.
#include "accel/occlusion_block.clh"
#include "accel/traverse_scalar.clh"
#include "accel/traverse_wide.clh"

#if defined(KILN_RAY_SCALAR) || defined(KILN_RAY_SINGLE)

#ifdef KILN_RAY_SCALAR
kernel void kiln_occlusion_any_scalar(
#else
kernel void kiln_occlusion_any_wide(
#endif
    const kiln_ray_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uchar* restrict occluded) {
  const uint index = params.first + (uint)get_global_id(0);
  if (index >= params.end) return;
  ray_state ray;
  ray_hit hit;
  ray_start(points, index, params, &hit);
  if (ray_load(points, index, params, &ray)) {
#ifdef KILN_RAY_SCALAR
    scalar_trace(nodes, blocks, &ray, 0, true, &hit);
#else
    wide_trace(nodes, blocks, &ray, 0, true, &hit);
#endif
  }
  occluded[index] = hit.triangle != KILN_NO_TRIANGLE ? 1 : 0;
}

#else

kernel void kiln_occlusion_any_stream(
    const kiln_ray_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uchar* restrict occluded) {
  const uint first = params.first + (uint)get_global_id(0) * KILN_OCCLUSION_BLOCK;
  if (first >= params.end) return;
  const uint count = min(params.end - first, (uint)KILN_OCCLUSION_BLOCK);
  occlusion_block(params, nodes, blocks, points, first, count, occluded);
}

#endif
