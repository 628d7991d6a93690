// Parameters of rating a match by pictures from many directions.
#ifndef KILN_SHARED_ASSESS_H
#define KILN_SHARED_ASSESS_H

#include "shared/common.h"

struct kiln_assess_params {
  kiln_float direction[3];  ///< Unit, from the surface to the viewer
  kiln_uint count;          ///< Samples
  kiln_uint capacity;       ///< Elements of one plane
  kiln_uint padding[3];
};
typedef struct kiln_assess_params kiln_assess_params;
KILN_CHECK_SIZE(kiln_assess_params, 32);

/// Planes of the sums that a sample gathers over all directions.
#define KILN_ASSESS_SEEN 0           ///< Of cosines to the viewer, where the sample is visible
#define KILN_ASSESS_ACROSS 1         ///< The same times the match's distance to the ray
#define KILN_ASSESS_ACROSS_SQUARE 2  ///< The same times its square
#define KILN_ASSESS_MET 3    ///< Of cosines, where the ray meets a front face of the high poly
#define KILN_ASSESS_APART 4  ///< The same times the distance from the match to that point
#define KILN_ASSESS_APART_SQUARE 5  ///< The same times its square
#define KILN_ASSESS_SUMS 6

#endif
