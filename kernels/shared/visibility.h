// Visibility directions: from where the low poly's surface is seen.
#ifndef KILN_SHARED_VISIBILITY_H
#define KILN_SHARED_VISIBILITY_H

#include "shared/common.h"

/// Faces seen at a smaller cosine than this do not count as seen. Also bounds how near a ray that leaves
/// a face stays to it.
#define KILN_VISIBILITY_LEAST_COSINE 0.02f

/// A matching direction leaves its face at this cosine at least.
///
/// Beside a ridge the mean of what sees both sides may lie along the wall, or lead into it: the ray would
/// run far over the face, or under it. It is raised along the face's normal, which changes it the least
/// of all ways.
#define KILN_VISIBILITY_LEAST_RISE 0.1f

/// Depth of a pixel that shows nothing.
#define KILN_VISIBILITY_FAR 1e30f

/// Samples that a work-item of the vector kernel takes.
#define KILN_VISIBILITY_SAMPLES 64

/// Pixels of a field by how they are smoothed.
#define KILN_VISIBILITY_EMPTY 0
#define KILN_VISIBILITY_INNER 1   ///< All 8 neighbours are of the same chart
#define KILN_VISIBILITY_BORDER 2  ///< Some lie across a seam

#define KILN_VISIBILITY_NO_LINK 0xFFFFFFFFu

struct kiln_visibility_params {
  kiln_uint count;     ///< Items
  kiln_uint capacity;  ///< Elements of one plane of the points and of the sums
  kiln_uint view_count;
  kiln_uint view_size;  ///< Pixels a side
  kiln_float bias;      ///< What lies this much nearer than a sample does not hide it; frame units
  kiln_float scale;     ///< Points are multiplied by this
  kiln_uint out_capacity;     ///< Of what kiln_visibility_prepare writes
  kiln_uint first_direction;  ///< Of the batch
};
typedef struct kiln_visibility_params kiln_visibility_params;
KILN_CHECK_SIZE(kiln_visibility_params, 32);

/// The source of directions of a band's samples.
struct kiln_visibility_band {
  kiln_uint texel_count;
  kiln_uint capacity;      ///< Of the band's planes
  kiln_uint out_capacity;  ///< Of the written planes
  kiln_uint first_row;     ///< Of the band
  kiln_uint width;         ///< Of the map
  kiln_uint height;
  kiln_uint samples;      ///< N: N x N a texel
  kiln_uint field_width;  ///< 0: the field is one of corners
  kiln_uint field_height;
  kiln_uint hybrid;
  kiln_uint padding[2];
};
typedef struct kiln_visibility_band kiln_visibility_band;
KILN_CHECK_SIZE(kiln_visibility_band, 48);

#endif
