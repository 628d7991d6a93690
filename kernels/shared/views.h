// Parameters of matching by depth views.
#ifndef KILN_SHARED_VIEWS_H
#define KILN_SHARED_VIEWS_H

#include "shared/common.h"

/// Which view decides a sample, of those whose depth is within the distance.
#define KILN_VIEWS_DEPTH 0u     ///< Least depth difference at the pixel (Wang et al., section 2)
#define KILN_VIEWS_DISTANCE 1u  ///< Least distance to the point under the sample's own place
#define KILN_VIEWS_ANGLE 2u     ///< Most along the sample's direction (Wang et al., section 6)

struct kiln_views_params {
  kiln_uint count;            ///< Samples
  kiln_uint capacity;         ///< Elements of one plane of the points
  kiln_uint result_capacity;  ///< Elements of one plane of the barycentrics
  kiln_uint view_count;
  kiln_uint criterion;
  kiln_float max_distance;
  kiln_float least_cosine;    ///< Views that see a sample more aslant than this do not count
  kiln_uint refine;           ///< Move to the point on the sample's own direction, where a view shows it
};
typedef struct kiln_views_params kiln_views_params;
KILN_CHECK_SIZE(kiln_views_params, 32);

#endif
