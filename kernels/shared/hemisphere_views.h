// Structs of hemispheres that are gathered by depth views.
#ifndef KILN_SHARED_HEMISPHERE_VIEWS_H
#define KILN_SHARED_HEMISPHERE_VIEWS_H

#include "shared/common.h"

/// Sums of a sample: cosines of even and odd directions that are open, of all even and odd ones.
#define KILN_HEMISPHERE_VIEW_SUMS 4

struct kiln_hemisphere_views_params {
  kiln_uint count;        // samples
  kiln_uint capacity;     // elements of one plane of the points and of the sums
  kiln_uint bent_sum_plane;   // ... of sums of directions
  kiln_uint view_count;
  kiln_uint view_size;    // pixels a side
  kiln_uint first_view;   // number of the batch's first direction
  kiln_float bias;        // what lies this much nearer than a sample does not hide it; the pictures' units
  kiln_float scale;       // points are multiplied by this
};
typedef struct kiln_hemisphere_views_params kiln_hemisphere_views_params;
KILN_CHECK_SIZE(kiln_hemisphere_views_params, 32);

#endif
