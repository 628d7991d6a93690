// Structs of the texel family: scan conversion of UV triangles.
#ifndef KILN_SHARED_TEXEL_H
#define KILN_SHARED_TEXEL_H

#include "shared/common.h"

#ifdef __OPENCL_C_VERSION__
typedef long kiln_long;
#else
typedef int64_t kiln_long;
#endif

/// A UV triangle ready for scan conversion, in fixed point: a sample is 2^shift units wide, the map's
/// longer side at most 2^28. Edge function k, of the edge opposite corner k, at sample (i, j) is
///   E_k = ((a[k] * i + b[k] * j) << shift) + c[k]
/// and is positive inside for either winding. The three add up to the doubled area.
typedef struct kiln_texel_piece {
  kiln_long c[3];
  kiln_int a[3];
  kiln_int b[3];
  kiln_uint triangle;  // triangle of the low poly
  kiln_uint first;     // first piece of the same triangle (several if it was clipped)
  kiln_uint closed;    // bit k: a sample on edge k belongs to this piece (top-left rule)
  kiln_uint drop;      // right shift that makes E_k fit 31 bits
} kiln_texel_piece;
KILN_CHECK_SIZE(kiln_texel_piece, 64);

/// Corner values that are interpolated over a piece.
typedef struct kiln_texel_corners {
  kiln_float position[9];  // index = 3 * corner + component
  kiln_float direction[9];
  kiln_float weight1[3];  // the triangle's barycentrics at the piece's corners
  kiln_float weight2[3];
  kiln_float reciprocal;  // factor that converts E_k >> drop to barycentrics
  kiln_float padding[3];
} kiln_texel_corners;
KILN_CHECK_SIZE(kiln_texel_corners, 112);

/// A block is a square of texels whose samples one work-item processes. Its samples are called slots. They are ordered
/// texel by texel along a Morton curve, row by row within a texel.
typedef struct kiln_texel_params {
  kiln_uint block_count;
  kiln_uint group_count;    // groups of 8 slots in a block, the last one padded
  kiln_uint block_texels;   // texels in a block
  kiln_uint texel_samples;  // samples in a texel: N * N
  kiln_uint samples;        // N
  // number of fixed-point bits below one sample: a sample is 2^shift units wide
  kiln_uint shift;
  kiln_int sample_width;    // width of the map, samples
  kiln_int sample_height;
  kiln_uint width;      // width of the map, texels
  kiln_uint first_row;  // first row of the band, texels
  kiln_uint capacity;   // elements per component plane of barycentric and points
  kiln_uint padding;
} kiln_texel_params;
KILN_CHECK_SIZE(kiln_texel_params, 48);

/// A block of texels: its position, the pieces that may overlap it, and the position of its
/// results.
typedef struct kiln_texel_block {
  kiln_int x;  // column of the block's first sample
  kiln_int y;
  // Index in the array of lists of the first piece that may overlap the block; pieces are in ascending order
  kiln_uint list_begin;
  kiln_uint list_end;
} kiln_texel_block;
KILN_CHECK_SIZE(kiln_texel_block, 16);

/// Bit fields of a block's counts, which kiln_texel_cover returns.
#define KILN_TEXEL_SAMPLES(count) ((count)&0x3FFu)
#define KILN_TEXEL_TEXELS(count) (((count) >> 10) & 0x3FFu)
#define KILN_TEXEL_OVERLAPS(count) (((count) >> 20) & 0x3FFu)

/// KILN_TEXEL_EMPTY is the value of a slot that no triangle covers, KILN_TEXEL_OVERLAP the flag of a slot that several
/// triangles cover.
#define KILN_TEXEL_EMPTY 0x7FFFFFFFu
#define KILN_TEXEL_OVERLAP 0x80000000u

#endif
