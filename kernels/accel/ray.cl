// Nearest hits of rays that leave samples of the low poly, on the high poly.
//
// Algorithm: a BVH of 8-wide nodes (see shared/bvh.h) is traversed nearest child first, with a
// watertight triangle test (see accel/triangle.clh) that all variants share. Ties in t go to the
// smaller triangle. Culling is strict and its arithmetic is monotone: the result is a function of
// ray and triangles alone.
//
// Which hit counts (shared/ray.h): the smallest t; or outward first, the nearest t >= 0, else the
// nearest t < 0; or the outermost, the greatest t. An outermost ray also reports whether it has hits
// at two or more different t >= 0: only there can its result differ from outward first, and the host
// checks (host/match/outermost.cpp) whether the low poly lies between.
//
// KILN_RAY_ANY makes the beam kernel end each ray at its first hit, so that callers that only need to know whether there
// is one, and cast too few rays to compile occlusion.cl for, need no second program.
//
// | kernel                  | global size         | local | reads, writes a sample            |
// | kiln_ray_closest_beam   | samples / 64, up    | 64    | 24 B (28 with reach) + tree, 17 B |
// | kiln_ray_closest_scalar | samples             | 64    | the same                          |
//
// Defines: KILN_RAY_SCALAR      build the scalar kernel instead of the beam
//          KILN_LANES           8 or 16, rays a vector; default by the device (lib/vector.clh)
//          KILN_PORTABLE_MASKS  no x86 instructions (lib/mask.clh)
//          KILN_BVH_PLAIN       the tree has no prisms (prism.clh)
//
// Strengths: neighbouring samples (blocks of 8 x 8, or halves of them) share one traversal. Limits: rays that have
// little in common are traced one by one. Origins beyond 2^20 frame units and directions longer than 2 miss.
#include "accel/beam.clh"
#include "accel/traverse_scalar.clh"
#include "lib/call.clh"

/// Samples of a work-item: one beam of 64 rays or two of 32.
#define KILN_ITEM_RAYS 64

#ifdef KILN_RAY_SCALAR

kernel void kiln_ray_closest_scalar(
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
  const int order = ray_order(params);
  ray_state ray;
  ray_hit hit;
  ray_start(points, index, params, &hit);
  if (ray_load(points, index, params, &ray)) {
    scalar_trace(nodes, blocks, &ray, order, false, &hit);
  }
  ray_store(index, params, &ray, &hit, triangle, barycentric, distance, status);
}

#else

/// The rays of one beam.
static KILN_CALL void ray_cast_beam(const kiln_ray_params params,
                                       global const kiln_bvh_node* nodes,
                                       global const kiln_bvh_block* blocks,
                                       global const float* points, uint first,
                                       global uint* triangle, global float* barycentric,
                                       global float* distance, global uchar* status) {
  const int order = ray_order(params);
  beam_rays rays;
  beam_bounds bounds;
  const uint count = min(params.end - first, (uint)KILN_BEAM_RAYS);
  vfloat segment_lo[3][KILN_BEAM_VECTORS], segment_hi[3][KILN_BEAM_VECTORS];
  // Rays that end at any hit gain nothing from a beam, which ends with its last ray.
  const bool any_hit = (params.flags & KILN_RAY_ANY) != 0;
  const bool beam = !any_hit && count == KILN_BEAM_RAYS &&
                    beam_load(points, first, params, &rays, segment_lo, segment_hi) &&
                    beam_bound(params, &rays, segment_lo, segment_hi, &bounds);
  if (beam && beam_trace(nodes, blocks, order, &rays, &bounds)) {
    beam_store(first, params, &rays, points, triangle, barycentric, distance, status);
    return;
  }
  for (uint i = 0; i < count; ++i) {
    ray_state ray;
    ray_hit hit;
    ray_start(points, first + i, params, &hit);
    if (ray_load(points, first + i, params, &ray)) {
      if (beam) beam_extract(&rays, i, &hit);
      wide_trace(nodes, blocks, &ray, order, any_hit, &hit);
    }
    ray_store(first + i, params, &ray, &hit, triangle, barycentric, distance, status);
  }
}

kernel void kiln_ray_closest_beam(
    const kiln_ray_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uint* restrict triangle,
    global float* restrict barycentric,
    global float* restrict distance,
    global uchar* restrict status) {
  const uint first = params.first + (uint)get_global_id(0) * KILN_ITEM_RAYS;
  const uint end = min(first + KILN_ITEM_RAYS, params.end);
  for (uint at = first; at < end; at += KILN_BEAM_RAYS) {
    ray_cast_beam(params, nodes, blocks, points, at, triangle, barycentric, distance, status);
  }
}

#endif
