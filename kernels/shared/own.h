// Parameters of user-defined maps.
#ifndef KILN_SHARED_OWN_H
#define KILN_SHARED_OWN_H

#include "shared/common.h"

struct kiln_user_map_params {
  kiln_uint first;         ///< First sample of this launch
  kiln_uint end;           ///< One past the last sample of this launch
  kiln_uint low_capacity;  ///< Elements per component plane of the low poly's samples
  kiln_uint hit_capacity;  ///< Elements per component plane of the correspondence
  kiln_uint out_capacity;  ///< Elements per component plane of the values
  kiln_uint two_sided;     ///< 1: normals that point away from the low poly are flipped
  kiln_uint has_uvs;       ///< 1: the high poly has UVs
  kiln_uint has_match;     ///< 1: the correspondence has distances and statuses
  kiln_float scale;        ///< Frame units per world unit
  kiln_float center_x;     ///< Centre of the frame, world units
  kiln_float center_y;
  kiln_float center_z;
};
typedef struct kiln_user_map_params kiln_user_map_params;
KILN_CHECK_SIZE(kiln_user_map_params, 48);

#endif
