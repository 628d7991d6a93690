// What the self-test of a device computes: results of operation o of work-item i at [o * KILN_SELFTEST_ITEMS + i].
#ifndef KILN_SHARED_SELFTEST_H
#define KILN_SHARED_SELFTEST_H

#include "shared/common.h"

#define KILN_SELFTEST_ITEMS 256
#define KILN_SELFTEST_LANES 16  ///< Inputs of a work-item, which all widths of vectors take

// Operations on scalars and on vectors of 4, 8 and 16.
#define KILN_SELFTEST_SUMS 0        ///< Float products and sums, not contracted
#define KILN_SELFTEST_FMA 1         ///< Float fused multiply-add
#define KILN_SELFTEST_DIVISION 2    ///< Float division and square root
#define KILN_SELFTEST_ROUNDING 3    ///< min, max, clamp, fabs, floor, rint, copysign
#define KILN_SELFTEST_SELECT 4      ///< Comparisons and selects
#define KILN_SELFTEST_CONVERT 5     ///< Between float, int, short and uchar
#define KILN_SELFTEST_INTEGER 6     ///< 32 bits: products, shifts, counts of bits
#define KILN_SELFTEST_LONG 7        ///< 64 bits: the edge functions of texels
#define KILN_SELFTEST_OPERATIONS 8  ///< How many a width has

// After those of the four widths.
#define KILN_SELFTEST_MASKS 32  ///< Bits of vector comparisons
#define KILN_SELFTEST_HIT 33    ///< The triangle that a ray meets, one box at a time
#define KILN_SELFTEST_WHERE 34  ///< Where on the ray and the triangle that is
#define KILN_SELFTEST_WIDE_HIT 35
#define KILN_SELFTEST_WIDE_WHERE 36
#define KILN_SELFTEST_ATOMICS 37  ///< What the items' atomic operations left in word i
#define KILN_SELFTEST_RESULTS 38

#define KILN_SELFTEST_CELLS 8  ///< Words each: least, greatest, count, and the high and low halves of the least of 64 bits

#endif
