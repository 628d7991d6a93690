// Structs and constants of the BVH builder on devices: see kernels/accel/bvh.cl.
#ifndef KILN_SHARED_BVH_BUILD_H
#define KILN_SHARED_BVH_BUILD_H

#include "shared/common.h"

/// Number of consecutive elements that a work-item of a reduction, a scan or a sort processes in order.
#define KILN_BVH_RUN 32

/// Digits of the radix sort. Two 64-bit numbers hold a counter of 8 bits per digit, which KILN_BVH_RUN keys cannot
/// overflow.
#define KILN_BVH_DIGIT_BITS 4
#define KILN_BVH_DIGITS 16
#define KILN_BVH_KEY_BITS 64

/// Key of a triangle: bit 63 is set if the triangle is not in the tree; then come 48 bits of the Morton code of the
/// box's centre, and 15 bits of a hash of its corners, by which duplicates become neighbours.
#define KILN_BVH_KEY_SKIPPED 0x8000000000000000ul
#define KILN_BVH_HASH_BITS 15
/// Number of cells of the Morton code along the longest axis.
#define KILN_BVH_CELLS 65536

/// Number of neighbours on either side among which a cluster searches its partner.
#define KILN_BVH_SEARCH_RADIUS 8

/// Classes of triangles.
#define KILN_BVH_SKIPPED 0    // not finite, or without area
#define KILN_BVH_USABLE 1     // in the tree, unless it is a duplicate
#define KILN_BVH_UNCERTAIN 2  // too thin for single precision: the host decides
#define KILN_BVH_BAD_INDEX 3  // an index lies beyond the positions

/// Summary of a range of triangles: the bounds of the doubled centres of usable triangles' boxes, and numbers of
/// triangles by class.
struct kiln_bvh_summary {
  kiln_float lo[3];
  kiln_float hi[3];
  kiln_uint usable;
  kiln_uint uncertain;
  kiln_uint bad;
  kiln_uint pad[3];
};
typedef struct kiln_bvh_summary kiln_bvh_summary;
KILN_CHECK_SIZE(kiln_bvh_summary, 48);

/// A node of the binary tree: its box, not widened, and its two children. A leaf has the index of its triangle as
/// `left`, and KILN_NO_TRIANGLE as `right`.
struct kiln_bvh_branch {
  kiln_float lo[3];
  kiln_uint left;
  kiln_float hi[3];
  kiln_uint right;
};
typedef struct kiln_bvh_branch kiln_bvh_branch;
KILN_CHECK_SIZE(kiln_bvh_branch, 32);

#endif
