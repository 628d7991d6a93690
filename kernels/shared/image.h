// Structs and formats of padding, shared by kernels/image and host/image/gutter.cpp.
#ifndef KILN_SHARED_IMAGE_H
#define KILN_SHARED_IMAGE_H

#include "shared/common.h"

/// Largest padding radius that the narrow format of offsets, 16 bits, can hold.
#define KILN_GUTTER_NARROW_RADIUS 127
/// Largest padding radius with the wide format of offsets, 32 bits.
#define KILN_GUTTER_WIDE_RADIUS 16384
/// Format of an offset: (dy + bias) << shift | (dx + bias), 0 for none; 16 bits with a bias of 128
/// and a shift of 8 (narrow), 32 bits with 32768 and 16 (wide).
#define KILN_GUTTER_NARROW_SHIFT 8
#define KILN_GUTTER_WIDE_SHIFT 16

/// A band of rows whose empty texels are filled from the nearest source.
typedef struct kiln_gutter_band {
  kiln_uint height;     ///< Height of the image
  /// Row stride of mask and offsets, texels: the width rounded up to 8, or more
  kiln_uint stride;
  /// Extra keys ("no source") on each side of a row of keys; at least `radius`
  kiln_uint pad;
  kiln_uint radius;     ///< 1 to KILN_GUTTER_*_RADIUS
  kiln_uint first_row;  ///< First row of the band
  kiln_uint row_count;  ///< Rows of the band
  kiln_uint tile_rows;  ///< Rows per item of the column kernel
  kiln_uint reserved;
} kiln_gutter_band;
KILN_CHECK_SIZE(kiln_gutter_band, 32);

#endif
