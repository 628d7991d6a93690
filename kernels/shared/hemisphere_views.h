// Structs of hemispheres that are gathered by depth views.
#ifndef KILN_SHARED_HEMISPHERE_VIEWS_H
#define KILN_SHARED_HEMISPHERE_VIEWS_H

#include "shared/common.h"

/// Number of planes of sums. They hold sums of cosines: over the open directions with even numbers, the open ones with
/// odd numbers, all with even numbers, and all with odd numbers.
#define KILN_HEMISPHERE_VIEW_SUMS 4

struct kiln_hemisphere_views_params {
  kiln_uint count;        // number of samples
  kiln_uint capacity;     // elements per component plane of the points and of the sums
  kiln_uint bent_sum_plane;   // elements per component plane of the sums of directions
  kiln_uint view_count;
  kiln_uint view_size;    // pixels a side of a view
  kiln_uint first_view;   // index of the batch's first direction
  // depth tolerance in the pictures' units: a surface hides a sample only if it is nearer by more than this
  kiln_float bias;
  kiln_float scale;       // factor that converts points to the pictures' units
};
typedef struct kiln_hemisphere_views_params kiln_hemisphere_views_params;
KILN_CHECK_SIZE(kiln_hemisphere_views_params, 32);

#endif
