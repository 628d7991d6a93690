// Parameters of assessing a match with viewing rays from many directions.
#ifndef KILN_SHARED_ASSESS_H
#define KILN_SHARED_ASSESS_H

#include "shared/common.h"

struct kiln_assess_params {
  kiln_float direction[3];  ///< Unit, from the surface to the viewer
  kiln_uint count;          ///< Number of samples
  kiln_uint capacity;       ///< Elements of one plane
  kiln_uint padding[3];
};
typedef struct kiln_assess_params kiln_assess_params;
KILN_CHECK_SIZE(kiln_assess_params, 32);

/// Planes of the sums of a sample over all directions.
/// Sum of cosines to the viewer over directions that see the sample
#define KILN_ASSESS_SEEN 0
/// Sum of cosine times the matched point's distance to the ray
#define KILN_ASSESS_ACROSS 1
/// Sum of cosine times the square of the matched point's distance to the ray
#define KILN_ASSESS_ACROSS_SQUARE 2
#define KILN_ASSESS_MET 3    ///< Sum of cosines over rays that hit a front face of the high poly
/// Sum of cosine times the distance from the matched point to the ray's hit on the high poly
#define KILN_ASSESS_APART 4
/// Sum of cosine times the square of that distance
#define KILN_ASSESS_APART_SQUARE 5
#define KILN_ASSESS_SUMS 6

#endif
