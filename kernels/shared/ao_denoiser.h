// Structs of the ao_denoiser family: smoothing of ambient occlusion over the surface.
#ifndef KILN_SHARED_SHARE_FILTER_H
#define KILN_SHARED_SHARE_FILTER_H

#include "shared/common.h"

/// Neighbours of a texel: left, right, above, below, then the diagonal ones.
#define KILN_AO_DENOISER_NEIGHBOURS 8

struct kiln_ao_denoiser_params {
  kiln_uint count;   // number of texels
  kiln_uint points;  // elements per component plane of the points
};
typedef struct kiln_ao_denoiser_params kiln_ao_denoiser_params;
KILN_CHECK_SIZE(kiln_ao_denoiser_params, 8);

#endif
