// Visibility directions: mean directions from which the low poly's surface is seen.
#ifndef KILN_SHARED_VISIBILITY_H
#define KILN_SHARED_VISIBILITY_H

#include "shared/common.h"

/// Smallest cosine at which a face counts as seen. Also bounds the angle between a face and a ray that
/// leaves it.
#define KILN_VISIBILITY_LEAST_COSINE 0.02f

/// Smallest cosine between a matching direction and its face.
///
/// Beside a ridge the mean of the directions that see both sides may run along the wall, or into it, so
/// that the ray would run far over the face, or under it. It is raised along the face's normal, the
/// smallest change that suffices.
#define KILN_VISIBILITY_LEAST_RISE 0.1f

/// Depth of an empty pixel.
#define KILN_VISIBILITY_FAR 1e30f

/// Samples per work-item of the vector kernel.
#define KILN_VISIBILITY_SAMPLES 64

/// Kinds of a field's pixels, by their smoothing.
#define KILN_VISIBILITY_EMPTY 0
#define KILN_VISIBILITY_INNER 1   ///< All 8 neighbours belong to the same chart
#define KILN_VISIBILITY_BORDER 2  ///< Some neighbours lie across a seam

#define KILN_VISIBILITY_NO_LINK 0xFFFFFFFFu

struct kiln_visibility_params {
  kiln_uint count;     ///< Number of items
  kiln_uint capacity;  ///< Elements of one plane of the points and of the sums
  kiln_uint view_count;
  kiln_uint view_size;  ///< Pixels a side
  kiln_float bias;      ///< Depth tolerance: surfaces nearer than a sample by less do not hide it;
                        ///< frame units
  kiln_float scale;     ///< Factor of the points
  kiln_uint out_capacity;     ///< Elements of one plane of the output of kiln_visibility_prepare
  kiln_uint first_direction;  ///< First direction of the batch
};
typedef struct kiln_visibility_params kiln_visibility_params;
KILN_CHECK_SIZE(kiln_visibility_params, 32);

/// Parameters of visibility directions for a band's samples.
struct kiln_visibility_band {
  kiln_uint texel_count;
  kiln_uint capacity;      ///< Elements of one plane of the band
  kiln_uint out_capacity;  ///< Elements of one plane of the output
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
