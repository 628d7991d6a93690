// Does a ray meet anything? The first hit found ends the walk; otherwise as in ray.cl.
//
// | kernel                     | global size | local | reads, writes a sample          |
// | kiln_occlusion_any_wide    | samples     | 64    | 24 B (28 with reach) + tree, 1 B |
// | kiln_occlusion_any_scalar  | samples     | 64    | the same                        |
//
// Defines and limits: see ray.cl.
#include "lib/traverse_scalar.clh"
#include "lib/traverse_wide.clh"

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
  ray_start(params, &hit);
  if (ray_load(points, index, params, &ray)) {
#ifdef KILN_RAY_SCALAR
    scalar_trace(nodes, blocks, &ray, 0, true, &hit);
#else
    wide_trace(nodes, blocks, &ray, 0, true, &hit);
#endif
  }
  occluded[index] = hit.triangle != KILN_NO_TRIANGLE ? 1 : 0;
}
