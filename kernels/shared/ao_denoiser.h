// Structs of the ao_denoiser family: shares of rays that are smoothed over the surface.
#ifndef KILN_SHARED_SHARE_FILTER_H
#define KILN_SHARED_SHARE_FILTER_H

#include "shared/common.h"

/// Texels beside a texel: left, right, above, below, then the diagonal ones.
#define KILN_SHARE_NEIGHBOURS 8

struct kiln_share_params {
  kiln_uint count;   // number of texels
  kiln_uint points;  // elements of one plane of the points
};
typedef struct kiln_share_params kiln_share_params;
KILN_CHECK_SIZE(kiln_share_params, 8);

#endif
