// Shared by kernels/image and host/image/gutter.cpp.
#ifndef KILN_SHARED_IMAGE_H
#define KILN_SHARED_IMAGE_H

#include "shared/common.h"

/// The largest gutter that the narrow form of the keys holds.
#define KILN_GUTTER_NARROW_RADIUS 127
/// ... and the wide form.
#define KILN_GUTTER_WIDE_RADIUS 16384
/// An offset is (dy + bias) << shift | (dx + bias), 0 where there is none: 16 bits with a bias of 128
/// and a shift of 8 (narrow), 32 bits with 32768 and 16 (wide).
#define KILN_GUTTER_NARROW_SHIFT 8
#define KILN_GUTTER_WIDE_SHIFT 16

/// A band of rows whose empty texels look for the nearest source.
typedef struct kiln_gutter_band {
  kiln_uint height;     ///< Of the image
  kiln_uint stride;     ///< Texels in a row of the mask and of the offsets: width, up to 8 more
  kiln_uint pad;        ///< Keys that mean "none" on each side of a row of keys; at least radius
  kiln_uint radius;     ///< 1 to KILN_GUTTER_*_RADIUS
  kiln_uint first_row;  ///< Of the band
  kiln_uint row_count;  ///< Of the band
  kiln_uint tile_rows;  ///< Rows that one item of the column kernel goes through
  kiln_uint reserved;
} kiln_gutter_band;
KILN_CHECK_SIZE(kiln_gutter_band, 32);

#endif
