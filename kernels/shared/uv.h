// Structs of the uv family: rasterising the high poly's UV triangles.
#ifndef KILN_SHARED_UV_H
#define KILN_SHARED_UV_H

#include "shared/common.h"

/// A UV triangle of the high poly in fixed point (host/mesh/uv_grid.h): a sample is 2^shift units wide.
typedef struct kiln_uv_piece {
  kiln_int x[3];
  kiln_int y[3];
  kiln_uint triangle;
  kiln_uint clip;  // 0: a whole triangle; else 1 + index of its kiln_uv_clip
} kiln_uv_piece;
KILN_CHECK_SIZE(kiln_uv_piece, 32);

/// For a part of a clipped triangle: the whole triangle's barycentrics at the part's corners.
typedef struct kiln_uv_clip {
  kiln_float weight1[3];
  kiln_float weight2[3];
  kiln_float padding[2];
} kiln_uv_clip;
KILN_CHECK_SIZE(kiln_uv_clip, 32);

/// Largest side of a work-item's rectangle, samples, so that large triangles are distributed.
#define KILN_UV_TILE 64

/// Part of a piece that one work-item draws: a rectangle of up to KILN_UV_TILE samples a side.
typedef struct kiln_uv_task {
  kiln_uint piece;
  kiln_int x;
  kiln_int y;
  kiln_uint size;  // width | height << 16
} kiln_uv_task;
KILN_CHECK_SIZE(kiln_uv_task, 16);

typedef struct kiln_uv_params {
  kiln_uint first_task;
  kiln_uint task_count;
  kiln_int row_begin;  // rows of samples in the band
  kiln_int row_end;
  kiln_uint sample_width;  // width of the map, samples
  kiln_uint shift;
  kiln_uint samples;      // N
  kiln_uint width;        // width of the map, texels
  kiln_uint texel_count;  // number of covered texels of the band
  kiln_uint sample_count;
  kiln_uint band_capacity;  // elements per component plane of the samples' points
  kiln_uint hit_capacity;   // elements per component plane of the correspondence's barycentrics
  kiln_uint first_run;      // first run of KILN_UV_TILE rows of samples that overlaps the band
  kiln_uint run_count;
  kiln_uint count_overlap;  // 1: overlaps are recorded; 0: they are not
  kiln_uint padding;
} kiln_uv_params;
KILN_CHECK_SIZE(kiln_uv_params, 64);

/// Numbers of covered and of overlapping samples in a row, and the first overlap.
typedef struct kiln_uv_row {
  kiln_uint covered;
  kiln_uint overlapping;
  kiln_uint column;  // column of the first overlap
  kiln_uint lower;   // indices of the two pieces that overlap in that column
  kiln_uint upper;
  kiln_uint padding[3];
} kiln_uv_row;
KILN_CHECK_SIZE(kiln_uv_row, 32);

/// Value of a sample that no piece covers.
#define KILN_UV_EMPTY 0xFFFFFFFFu

#endif
