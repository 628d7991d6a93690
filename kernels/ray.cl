// Nearest hits of rays that leave samples of the light mesh, on the dense mesh.
//
// Algorithm: a hierarchy of 8-wide nodes (see shared/bvh.h) walked nearest child first, and a
// watertight triangle test (see lib/triangle.clh) that all variants share. Ties in t go to the smaller
// triangle. Culling is strict and its arithmetic is monotone, so the result is a function of the ray
// and the triangles alone.
//
// | kernel                | global size          | local | reads, writes a sample              |
// | kiln_ray_closest_wide | samples              | 64    | 24 B (28 with reach) + tree, 17 B   |
// | kiln_ray_closest_scalar | samples            | 64    | the same                            |
//
// Defines: KILN_RAY_SCALAR  build the scalar kernel instead of the wide one.
//          KILN_X86_MOVMSK  see lib/mask.clh.
//
// Limits: origins beyond 2^20 frame units and directions longer than 2 miss.
#include "lib/traverse_scalar.clh"
#include "lib/traverse_wide.clh"

#ifdef KILN_RAY_SCALAR
kernel void kiln_ray_closest_scalar(
#else
kernel void kiln_ray_closest_wide(
#endif
    const kiln_ray_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uint* restrict triangle,
    global float* restrict barycentric,
    global float* restrict distance,
    global uchar* restrict status) {
  const uint index = params.first + (uint)get_global_id(0);
  if (index >= params.end) return;
  const int two_way = (params.flags & KILN_RAY_OUTWARD_FIRST) != 0 ? -1 : 0;
  ray_state ray;
  ray_hit hit;
  ray_start(params, &hit);
  if (ray_load(points, index, params, &ray)) {
#ifdef KILN_RAY_SCALAR
    scalar_trace(nodes, blocks, &ray, two_way, false, &hit);
#else
    wide_trace(nodes, blocks, &ray, two_way, false, &hit);
#endif
  }
  ray_store(index, params, &ray, &hit, triangle, barycentric, distance, status);
}
