// Depth views: orthographic pictures of the high poly, one key per pixel.
#ifndef KILN_SHARED_RASTER_H
#define KILN_SHARED_RASTER_H

#include "shared/common.h"

/// Fixed point: a pixel is 2^8 units wide.
#define KILN_RASTER_SHIFT 8
#define KILN_RASTER_UNIT 256

/// Triangles whose bounding box exceeds this width or height, in fixed-point units, are drawn by the kernels for large
/// triangles. Edge functions of smaller ones fit 32 bits: 2 * 2^13 * 2^13.
#define KILN_RASTER_SMALL 8192

/// Largest side of a picture, pixels, so that coordinates are exact as floats.
#define KILN_RASTER_LARGEST 16384

/// log2 of a tile's side in pixels. Pictures are stored tile by tile, in rows of tiles, and row by row
/// within a tile; tiles at the right and lower borders extend past the picture.
#define KILN_RASTER_TILE_SHIFT 6
#define KILN_RASTER_TILE 64
#define KILN_RASTER_TILE_PIXELS 4096

/// Largest number of triangles, and of vertices, in a chunk, which kiln_tiles_draw draws as a unit.
#define KILN_RASTER_CHUNK 32

/// Number of boxes that are tested at a time.
#define KILN_RASTER_BOXES 16

/// Number of bands of rows that kiln_raster_draw_large distributes.
#define KILN_RASTER_BANDS 64

/// The key of an empty pixel: all bits set. A pixel's key holds the depth in its upper 32 bits,
/// the triangle in the lower ones. The smallest key wins: the nearest triangle, and the lowest
/// of equally near ones.
#define KILN_RASTER_EMPTY 0xFFFFFFFFFFFFFFFFul

/// Offset of depths, so that they are positive and their bits have the same order: depth =
/// KILN_RASTER_FAR - dot(toward, p), and nearer is less.
#define KILN_RASTER_FAR 1.0f

#define KILN_RASTER_TWO_SIDED 1u  ///< Faces turned away from the viewer are drawn, too

/// A view of a frame's points: pixel x = dot(right, p) * scale + left, y = top - dot(up, p) * scale,
/// rows from the top; looking against `toward`.
struct kiln_view {
  kiln_float right[3];
  kiln_float scale;  ///< Pixels per frame unit
  kiln_float up[3];
  kiln_float left;  ///< Pixels; a multiple of 1 / KILN_RASTER_UNIT
  kiln_float toward[3];
  kiln_float top;
  kiln_uint width;
  kiln_uint height;
  /// Index of the view's first pixel in the array of keys: a multiple of KILN_RASTER_TILE_PIXELS
  kiln_uint first;
  kiln_uint flags;
};
typedef struct kiln_view kiln_view;
KILN_CHECK_SIZE(kiln_view, 64);

/// Tiles per row of a picture of this width.
#define KILN_RASTER_TILES(size) (((size) + KILN_RASTER_TILE - 1u) >> KILN_RASTER_TILE_SHIFT)

/// A chunk of neighbouring triangles with their own vertices. Unused triangles have three corners at
/// vertex 0, and draw nothing.
struct kiln_raster_chunk {
  kiln_float position[3][KILN_RASTER_CHUNK];
  kiln_uint triangle[KILN_RASTER_CHUNK];  ///< Indices in the mesh
  unsigned char corner[3][KILN_RASTER_CHUNK];
  unsigned char pad[32];
};
typedef struct kiln_raster_chunk kiln_raster_chunk;
KILN_CHECK_SIZE(kiln_raster_chunk, 640);

/// Bounds of 16 chunks, and cones of their normals.
struct kiln_raster_bounds {
  kiln_float centre[3][KILN_RASTER_BOXES];
  kiln_float half_extent[3][KILN_RASTER_BOXES];
  /// Axis of the cone around the triangles' normals, and the cosine of the cone's half angle. A negative cosine stands
  /// for all directions.
  kiln_float axis[3][KILN_RASTER_BOXES];
  kiln_float cosine[KILN_RASTER_BOXES];
  kiln_float height[KILN_RASTER_BOXES];  ///< Smallest height of the chunk's triangles
};
typedef struct kiln_raster_bounds kiln_raster_bounds;
KILN_CHECK_SIZE(kiln_raster_bounds, 704);

/// Bounds of 16 chunks, or of 16 groups of 16 chunks, in a view: pixels, inclusive. For empty bounds
/// `first` lies beyond the picture or `last` before it.
struct kiln_raster_boxes {
  short first_x[KILN_RASTER_BOXES];
  short first_y[KILN_RASTER_BOXES];
  short last_x[KILN_RASTER_BOXES];
  short last_y[KILN_RASTER_BOXES];
};
typedef struct kiln_raster_boxes kiln_raster_boxes;
KILN_CHECK_SIZE(kiln_raster_boxes, 128);

#endif
