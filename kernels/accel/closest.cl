// The nearest point of the high poly for each sample of the low poly.
//
// Tarini, Cignoni, Scopigno 2003, "Visibility Based Methods and Assessment for Detail-Recovery",
// section 3.1. Faces turned away from the sample's direction (the dot product of their normal and the
// direction is below 0) are ignored, so that a sample does not match the wrong side of a thin sheet.
//
// Algorithm: the BVH of the rays (see shared/bvh.h) is traversed nearest child first, with a shrinking
// radius. All variants share one point-triangle distance (see nearest.clh). Ties go to the lowest
// triangle. Culling is strict and its arithmetic is monotone: the result depends on sample and
// triangles alone. On CPUs neighbouring samples are searched is_walked_as_group (see accel/closest_group.clh),
// starting at the last leaf of the preceding samples.
//
// | kernel                  | global size      | local | reads, writes a sample  |
// | kiln_closest_search_run | samples / 256, up | 16   | 24 B + tree, 17 B       |
// | kiln_closest_scalar     | samples          | 64    | the same                |
//
// Defines: KILN_CLOSEST_SCALAR  build the scalar kernel instead
//          KILN_CLOSEST_SINGLE  search one sample after the other, without groups: takes half the time to compile, for
//                               few samples
//          KILN_LANES           8 or 16, samples a vector; default by the device (lib/vector.clh)
//          KILN_PORTABLE_MASKS  no x86 instructions (lib/mask.clh)
//          KILN_BVH_PLAIN       the tree has no prisms (prism.clh)
//
// Strengths: independent of ray directions, and finds a point wherever the mesh is near. Limits: a
// miss visits all nodes within the distance. Samples beyond 2^20 frame units, or with a direction
// longer than 2 or none, miss.
#include "accel/closest.clh"
#include "accel/prism.clh"
#include "lib/call.clh"
#ifdef KILN_CLOSEST_SCALAR
#include "accel/closest_scalar.clh"

kernel void kiln_closest_scalar(
    const kiln_closest_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uint* restrict triangle,
    global float* restrict barycentric,
    global float* restrict distance,
    global uchar* restrict status) {
  const uint index = params.first + (uint)get_global_id(0);
  if (index >= params.end) return;
  closest_sample sample;
  closest_best best;
  closest_start(params, &best);
  if (closest_load(points, index, params, &sample)) {
    closest_scalar(nodes, blocks, &sample, &best);
  }
  closest_store(index, params, &best, triangle, barycentric, distance, status);
}

#else
#include "accel/closest_group.clh"

/// Samples [first, end), one group after the other.
static KILN_CALL void closest_search_run(const kiln_closest_params params,
                                         global const kiln_bvh_node* nodes,
                                         global const kiln_bvh_block* blocks,
                                         global const float* points, uint first, uint end,
                                         global uint* triangle, global float* barycentric,
                                         global float* distance, global uchar* status) {
#ifdef KILN_CLOSEST_SINGLE
  struct {
    uint seed;
  } group;
#else
  closest_group group;
#endif
  group.seed = KILN_NO_TRIANGLE;
  for (uint at = first; at < end; at += KILN_CLOSEST_GROUP) {
    const uint count = min(end - at, KILN_CLOSEST_GROUP);
#ifndef KILN_CLOSEST_SINGLE
    const bool is_walked_as_group =
        count == KILN_CLOSEST_GROUP && closest_group_load(points, at, params, &group);
    if (is_walked_as_group && closest_group_walk(nodes, blocks, &group)) {
      closest_group_store(at, params, &group, triangle, barycentric, distance, status);
      continue;
    }
#endif
    for (uint i = 0; i < count; ++i) {
      closest_sample sample;
      closest_best best;
      closest_start(params, &best);
      if (closest_load(points, at + i, params, &sample)) {
#ifndef KILN_CLOSEST_SINGLE
        if (is_walked_as_group) closest_extract(&group, i, &best);
#endif
        const uint seed = group.seed;
        if (seed != KILN_NO_TRIANGLE) closest_wide_leaf(blocks, seed, &sample, &best);
        closest_wide(nodes, blocks, &sample, seed, &best);
        if (best.block != KILN_NO_TRIANGLE) group.seed = best.block;
      }
      closest_store(at + i, params, &best, triangle, barycentric, distance, status);
    }
  }
}

kernel void kiln_closest_search_run(
    const kiln_closest_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uint* restrict triangle,
    global float* restrict barycentric,
    global float* restrict distance,
    global uchar* restrict status) {
  const uint first = params.first + (uint)get_global_id(0) * KILN_CLOSEST_RUN;
  if (first >= params.end) return;
  const uint end = min(params.end, first + KILN_CLOSEST_RUN);
  closest_search_run(params, nodes, blocks, points, first, end, triangle, barycentric, distance, status);
}

#endif
