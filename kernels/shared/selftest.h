// Results of a device's self-test: word i of result r at [r * KILN_SELFTEST_ITEMS + i].
#ifndef KILN_SHARED_SELFTEST_H
#define KILN_SHARED_SELFTEST_H

#include "shared/common.h"

#define KILN_SELFTEST_ITEMS 1024

// Operations on input i. The index r of an operation is the row of its result computed with scalars; rows r + 8, r + 16
// and r + 24 hold the results with vectors of 4, 8 and 16 lanes.
#define KILN_SELFTEST_SUMS 0        ///< Float products and sums, not contracted
#define KILN_SELFTEST_FMA 1         ///< Float fused multiply-add
#define KILN_SELFTEST_DIVISION 2    ///< Float division and square root
#define KILN_SELFTEST_ROUNDING 3    ///< min, max, clamp, fabs, floor, rint, copysign
#define KILN_SELFTEST_SELECT 4      ///< Comparisons, and selection by masks
#define KILN_SELFTEST_CONVERT 5     ///< Conversions between float, int, short and uchar
#define KILN_SELFTEST_INTEGER 6     ///< 32 bits: products, shifts, bit counts
#define KILN_SELFTEST_LONG 7        ///< 64 bits: the edge functions of texels
#define KILN_SELFTEST_OPERATIONS 8

/// Masks of comparisons of vectors with 16, 8 and 4 lanes, one of which holds input i
#define KILN_SELFTEST_MASKS 32
#define KILN_SELFTEST_ATOMICS 33  ///< Results of the items' atomic operations in word i
/// Triangle, t and two barycentric weights of a ray hit, computed by the kernel that bakes use
#define KILN_SELFTEST_RAY 34
#define KILN_SELFTEST_RESULTS 38

/// Words that hold results of atomic operations: minimum, maximum, count, then the high and the low halves of 64-bit
/// minima.
#define KILN_SELFTEST_CELLS 8

struct kiln_selftest_input {
  kiln_float a[KILN_SELFTEST_ITEMS], b[KILN_SELFTEST_ITEMS], c[KILN_SELFTEST_ITEMS];
  kiln_int p[KILN_SELFTEST_ITEMS], q[KILN_SELFTEST_ITEMS];
};
typedef struct kiln_selftest_input kiln_selftest_input;
KILN_CHECK_SIZE(kiln_selftest_input, 20480);

#endif
