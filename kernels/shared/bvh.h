// The bounding volume hierarchy: 8 children per node, leaves of up to 4 triangles.
#ifndef KILN_SHARED_BVH_H
#define KILN_SHARED_BVH_H

#include "shared/common.h"

#define KILN_BVH_WIDTH 8
#define KILN_BVH_LEAF_TRIANGLES 4

/// Each triangle's box is widened by this much on every side, in frame units (about 1): 16 units in the last place of
/// 1. Rounding may move a hit point out of the triangle, but not out of the widened box.
#define KILN_BVH_EPSILON (1.0f / 524288.0f)

/// Maximum number of levels of nodes in a tree; stacks hold 7 entries per level.
#define KILN_BVH_MAX_DEPTH 26
#define KILN_BVH_STACK (KILN_BVH_MAX_DEPTH * (KILN_BVH_WIDTH - 1) + 1)

/// Flag of a child that is a leaf; the other bits are the index of its block. Other children
/// are indices of nodes. Unused children are leaves with inverted infinite bounds, which no ray
/// hits.
#define KILN_BVH_LEAF 0x80000000u

/// Flag of a child that is a node with a bounding prism; the other bits are the index of the prism, and the node
/// follows it.
#define KILN_BVH_PRISM 0x40000000u

/// Boxes of the children as structure of arrays: planes[axis][0] are lower bounds, [axis][1] upper.
struct kiln_bvh_node {
  kiln_float planes[3][2][KILN_BVH_WIDTH];
  kiln_uint child[KILN_BVH_WIDTH];
  kiln_uint pad[KILN_BVH_WIDTH];
};
typedef struct kiln_bvh_node kiln_bvh_node;
KILN_CHECK_SIZE(kiln_bvh_node, 256);

/// A prism that bounds all triangles of a node, for nodes whose axis-aligned boxes are much too large, such as those of
/// stacked large triangles or fans. It is stored in the array of nodes. A ray that hits no face of the prism hits none
/// of the triangles, so a traversal may skip the node. A traversal without prism tests gives the same result.
///
/// The prism is larger than the triangles by KILN_BVH_PRISM_MARGIN on every side. Rays from within
/// KILN_BVH_PRISM_REACH on each axis are sheared as for a triangle. A difference of coordinates then has an
/// error of at most 2^-20; the product with a shear of at most 1 has the same error. The error of their sum
/// is 2^-19, so the error is 2^-18 for a corner of the prism or of a triangle, in each of two directions. The
/// margin is larger than the sum of both.
struct kiln_bvh_prism {
  kiln_float corner[3][KILN_BVH_WIDTH];  // [axis][corner]: 3 of the base, 3 of the top, 2 unused
  // outward normals, and distances from 0: sides, floor, roof
  kiln_float plane[4][KILN_BVH_WIDTH];
  kiln_float slack, tilt;                // see prism_may_hit_between() in kernels/accel/prism.clh
  kiln_uint pad[KILN_BVH_WIDTH - 2];
};
typedef struct kiln_bvh_prism kiln_bvh_prism;
KILN_CHECK_SIZE(kiln_bvh_prism, 256);

/// Lanes of `plane` that hold the floor and the roof of the prism.
#define KILN_BVH_PRISM_FLOOR 3
#define KILN_BVH_PRISM_ROOF 4

#define KILN_BVH_PRISM_MARGIN (1.0f / 32768.0f)
#define KILN_BVH_PRISM_REACH 8.0f

/// Corners of the faces of a bounding prism, one face per lane.
#define KILN_BVH_PRISM_A s03001122
#define KILN_BVH_PRISM_B s14142503
#define KILN_BVH_PRISM_C s25435435

/// Up to 4 triangles as structure of arrays. Unused lanes repeat a point of the first triangle
/// three times (no ray hits it), with KILN_NO_TRIANGLE.
struct kiln_bvh_block {
  kiln_float corner[3][3][KILN_BVH_LEAF_TRIANGLES];  // [corner][axis][lane]
  kiln_uint triangle[KILN_BVH_LEAF_TRIANGLES];
};
typedef struct kiln_bvh_block kiln_bvh_block;
KILN_CHECK_SIZE(kiln_bvh_block, 160);

#endif
