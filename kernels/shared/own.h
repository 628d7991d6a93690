// Parameters of the caller's own maps.
#ifndef KILN_SHARED_OWN_H
#define KILN_SHARED_OWN_H

#include "shared/common.h"

struct kiln_own_params {
  kiln_uint first;         ///< First sample of this launch
  kiln_uint end;           ///< One past its last sample
  kiln_uint low_capacity;  ///< Elements of one plane of the low poly's samples
  kiln_uint hit_capacity;  ///< ... of the correspondence
  kiln_uint out_capacity;  ///< ... of the values
  kiln_uint two_sided;     ///< 1: normals that point away from the low poly are turned to it
  kiln_uint has_uvs;       ///< 1: the high poly has UVs
  kiln_uint has_match;     ///< 1: the correspondence has distances and statuses
  kiln_float scale;        ///< Frame units a world unit
  kiln_float center_x;     ///< Of the frame, world units
  kiln_float center_y;
  kiln_float center_z;
};
typedef struct kiln_own_params kiln_own_params;
KILN_CHECK_SIZE(kiln_own_params, 48);

#endif
