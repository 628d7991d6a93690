// Parameters of matching by depth views.
#ifndef KILN_SHARED_VIEWS_H
#define KILN_SHARED_VIEWS_H

#include "shared/common.h"

/// Criterion that selects one view, among those whose depth difference is within the match's largest distance.
#define KILN_VIEWS_DEPTH 0u     ///< Smallest depth difference at the pixel (Wang et al., section 2)
#define KILN_VIEWS_DISTANCE 1u  ///< Smallest distance to the point under the sample's own position
/// Smallest angle to the sample's direction (Wang et al., section 6)
#define KILN_VIEWS_ANGLE 2u

struct kiln_views_params {
  kiln_uint count;            ///< Number of samples
  kiln_uint capacity;         ///< Elements per component plane of the points
  kiln_uint result_capacity;  ///< Elements per component plane of the barycentrics
  kiln_uint view_count;
  kiln_uint criterion;
  kiln_float max_distance;
  kiln_float least_cosine;    ///< Views at a smaller cosine to the face are ignored
  /// 1: move to the point on the line along the sample's own direction, if the view shows that point
  kiln_uint refine;
};
typedef struct kiln_views_params kiln_views_params;
KILN_CHECK_SIZE(kiln_views_params, 32);

#endif
