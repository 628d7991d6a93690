// Parameters of the ray kernels.
#ifndef KILN_SHARED_RAY_H
#define KILN_SHARED_RAY_H

#include "shared/common.h"

#define KILN_RAY_USE_REACH 1u      ///< The ray's offset is the reach stored with the sample
#define KILN_RAY_INWARD 2u         ///< Against the sample's direction
#define KILN_RAY_OUTWARD_FIRST 4u  ///< Nearest hit with t >= 0, else nearest with t < 0
#define KILN_RAY_TWO_SIDED 8u      ///< Faces turned away from the sample's direction count too
#define KILN_RAY_OUTERMOST 16u     ///< The hit with the greatest t
/// With OUTERMOST: hits with t above the sample's own reach do not count
#define KILN_RAY_LIMITED 32u
/// On CPUs any hit ends the ray. Only whether there is a hit, not which one, is then a function of ray and triangles
#define KILN_RAY_ANY 64u

/// Bit in a sample's status beside its provenance, set by rays with KILN_RAY_OUTERMOST: the ray has hits at two or more
/// different t >= 0.
#define KILN_RAY_SEVERAL 128u

/// Origins with a coordinate beyond this many frame units miss, since their arithmetic could
/// overflow.
#define KILN_RAY_FARTHEST 1048576.0f

/// Number of any-hit rays that are sorted, and cast as streams, together.
#define KILN_OCCLUSION_BLOCK 2048

/// Number of neighbouring rays whose nearest hits are found by one work-item of streams.
#define KILN_RAY_STREAM_BLOCK 256

struct kiln_ray_params {
  kiln_float t_min;
  kiln_float t_max;
  kiln_float offset;
  kiln_uint flags;
  kiln_uint first;     ///< First sample of this launch
  kiln_uint end;       ///< Index one past its last sample
  kiln_uint capacity;  ///< Elements per component plane of the points
  kiln_uint result_capacity;  ///< Elements per component plane of the barycentrics
};
typedef struct kiln_ray_params kiln_ray_params;
KILN_CHECK_SIZE(kiln_ray_params, 32);

#endif
