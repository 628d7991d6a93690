// Parameters of the closest-point kernels.
#ifndef KILN_SHARED_CLOSEST_H
#define KILN_SHARED_CLOSEST_H

#include "shared/common.h"

#define KILN_CLOSEST_TWO_SIDED 1u  ///< Faces turned away from the sample's direction count too

/// Samples with a coordinate beyond this many frame units miss, since their arithmetic could
/// overflow.
#define KILN_CLOSEST_FARTHEST 1048576.0f

/// Consecutive samples per work-item of the CPU's kernel, which are searched together.
#define KILN_CLOSEST_RUN 256u
#define KILN_CLOSEST_GROUP 16u

struct kiln_closest_params {
  kiln_float max_distance;
  kiln_uint flags;
  kiln_uint first;            ///< First sample of this launch
  kiln_uint end;              ///< One past the last sample of this launch
  kiln_uint capacity;         ///< Elements per component plane of the points
  kiln_uint result_capacity;  ///< Elements per component plane of the barycentrics
  kiln_uint padding[2];
};
typedef struct kiln_closest_params kiln_closest_params;
KILN_CHECK_SIZE(kiln_closest_params, 32);

#endif
