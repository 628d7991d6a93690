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

#endif
