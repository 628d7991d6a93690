// Depth views: an orthographic picture of the dense mesh, a key a pixel.
#ifndef KILN_SHARED_RASTER_H
#define KILN_SHARED_RASTER_H

#include "shared/common.h"

/// Fixed point: a pixel is 2^8 units wide.
#define KILN_RASTER_SHIFT 8
#define KILN_RASTER_UNIT 256

/// Triangles whose box is wider or higher than this many units take the path for large ones. Edge
/// functions of smaller ones fit 32 bits: 2 * 2^13 * 2^13.
#define KILN_RASTER_SMALL 8192

/// Pictures are at most this many pixels a side, so that coordinates are exact as floats.
#define KILN_RASTER_LARGEST 16384

/// Bands of rows that the large triangles' path hands out.
#define KILN_RASTER_BANDS 64

/// A pixel's key: the depth's bits above, the triangle below; the least key wins, so the nearest
/// triangle does, and of equally near ones the lowest. All ones: nothing.
#define KILN_RASTER_EMPTY 0xFFFFFFFFFFFFFFFFul

/// Depths are shifted by this, so that they are positive and their bits are ordered like them:
/// depth = KILN_RASTER_FAR - dot(toward, p), and nearer is less.
#define KILN_RASTER_FAR 1.0f

#define KILN_RASTER_TWO_SIDED 1u  ///< Faces turned away are drawn, too

/// A view of a frame's points: pixel x = dot(right, p) * scale + left, y = top - dot(up, p) * scale,
/// rows from the top; looking against `toward`.
struct kiln_view {
  kiln_float right[3];
  kiln_float scale;  ///< Pixels a frame unit
  kiln_float up[3];
  kiln_float left;  ///< Pixels; a multiple of 1 / KILN_RASTER_UNIT
  kiln_float toward[3];
  kiln_float top;
  kiln_uint width;
  kiln_uint height;
  kiln_uint first;  ///< Its first pixel within the array of keys
  kiln_uint flags;
};
typedef struct kiln_view kiln_view;
KILN_CHECK_SIZE(kiln_view, 64);

#endif
