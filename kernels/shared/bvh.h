// The bounding volume hierarchy: 8 children a node, leaves of up to 4 triangles.
#ifndef KILN_SHARED_BVH_H
#define KILN_SHARED_BVH_H

#include "shared/common.h"

#define KILN_BVH_WIDTH 8
#define KILN_BVH_LEAF_TRIANGLES 4

/// Each triangle's box is widened by this much on every side, in frame units (about 1): 16 units in
/// the last place of 1. Hit points move by rounding; they stay within the widened box.
#define KILN_BVH_EPSILON (1.0f / 524288.0f)

/// No tree is deeper than this many levels of nodes; stacks hold 7 entries a level.
#define KILN_BVH_MAX_DEPTH 26
#define KILN_BVH_STACK (KILN_BVH_MAX_DEPTH * (KILN_BVH_WIDTH - 1) + 1)

/// A child that is a leaf: this bit and the index of its block. Else the index of a node. Unused
/// children are leaves with inverted infinite bounds, which no ray meets.
#define KILN_BVH_LEAF 0x80000000u

/// Boxes of the children as structure of arrays: planes[axis][0] are lower bounds, [axis][1] upper.
struct kiln_bvh_node {
  kiln_float planes[3][2][KILN_BVH_WIDTH];
  kiln_uint child[KILN_BVH_WIDTH];
  kiln_uint pad[KILN_BVH_WIDTH];
};
typedef struct kiln_bvh_node kiln_bvh_node;
KILN_CHECK_SIZE(kiln_bvh_node, 256);

/// Up to 4 triangles as structure of arrays. Unused lanes hold a point of the first triangle three
/// times (no ray hits it) and KILN_NO_TRIANGLE.
struct kiln_bvh_block {
  kiln_float corner[3][3][KILN_BVH_LEAF_TRIANGLES];  // [corner][axis][lane]
  kiln_uint triangle[KILN_BVH_LEAF_TRIANGLES];
};
typedef struct kiln_bvh_block kiln_bvh_block;
KILN_CHECK_SIZE(kiln_bvh_block, 160);

#endif
