// Visibility directions: mean directions from which the low poly's surface is seen.
#ifndef KILN_SHARED_VISIBILITY_H
#define KILN_SHARED_VISIBILITY_H

#include "shared/common.h"

/// Smallest cosine between a view and a face's normal at which the face counts as seen. Also the
/// smallest cosine between the normal and a ray that leaves the face.
#define KILN_VISIBILITY_LEAST_COSINE 0.02f

/// Smallest cosine between a matching direction and its face.
///
/// Near a ridge, the mean of the directions from which both sides are visible may be parallel to a face or point into
/// it, so that a ray would run far along the face or below it. Such a direction is tilted towards the face's normal as
/// little as necessary.
#define KILN_VISIBILITY_LEAST_RISE 0.1f

/// Depth of an empty pixel.
#define KILN_VISIBILITY_FAR 1e30f

/// Samples per work-item of the vector kernel.
#define KILN_VISIBILITY_SAMPLES 64

/// Kinds of pixels of a visibility field, which are smoothed differently.
#define KILN_VISIBILITY_EMPTY 0
#define KILN_VISIBILITY_INNER 1   ///< All 8 neighbours belong to the same chart
#define KILN_VISIBILITY_BORDER 2  ///< Some neighbours lie across a seam

#define KILN_VISIBILITY_NO_LINK 0xFFFFFFFFu

struct kiln_visibility_params {
  kiln_uint count;     ///< Number of items
  kiln_uint capacity;  ///< Elements per component plane of the points and of the sums
  kiln_uint view_count;
  kiln_uint view_size;  ///< Pixels a side
  /// Depth tolerance in frame units: a surface hides a sample only if it is nearer by more than this
  kiln_float bias;
  kiln_float scale;     ///< Factor that converts points to the pictures' units
  kiln_uint out_capacity;     ///< Elements per component plane of the output of kiln_visibility_prepare
  kiln_uint first_direction;  ///< Index of the batch's first direction
};
typedef struct kiln_visibility_params kiln_visibility_params;
KILN_CHECK_SIZE(kiln_visibility_params, 32);

/// Parameters of visibility directions for a band's samples.
struct kiln_visibility_band {
  kiln_uint texel_count;
  kiln_uint capacity;      ///< Elements per component plane of the band
  kiln_uint out_capacity;  ///< Elements per component plane of the output
  kiln_uint first_row;     ///< First row of the band
  kiln_uint width;         ///< Width of the map
  kiln_uint height;
  kiln_uint samples;      ///< N: N x N samples per texel
  kiln_uint field_width;  ///< 0: the field is per corner
  kiln_uint field_height;
  kiln_uint hybrid;
  kiln_uint padding[2];
};
typedef struct kiln_visibility_band kiln_visibility_band;
KILN_CHECK_SIZE(kiln_visibility_band, 48);

#endif
