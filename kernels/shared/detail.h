// Structs of the detail family: the high poly's normals in the low poly's frames.
#ifndef KILN_SHARED_DETAIL_H
#define KILN_SHARED_DETAIL_H

#include "shared/common.h"

/// Shading data of one triangle of the low poly. All vectors are unit; index = 3 * corner + component.
typedef struct kiln_low_shading {
  kiln_float normal[9];
  kiln_float tangent[9];
  kiln_float sign;             // bitangent = sign * cross(normal, tangent)
  kiln_float face_tangent[3];  // along increasing u, in the face's plane
  kiln_float face_normal[3];
  kiln_float padding[7];
} kiln_low_shading;
KILN_CHECK_SIZE(kiln_low_shading, 128);

#define KILN_SPACE_TANGENT 0
#define KILN_SPACE_OBJECT 1
#define KILN_SPACE_FACE 2
// Tangent space whose bitangents are computed at the corners and interpolated
#define KILN_SPACE_TANGENT_VERTEX 4

typedef struct kiln_detail_params {
  kiln_uint count;          // number of samples
  kiln_uint low_capacity;   // elements per component plane of the samples' barycentrics
  kiln_uint hit_capacity;   // elements per component plane of the correspondence's barycentrics
  kiln_uint out_capacity;   // elements per component plane of the result
  kiln_int space;           // KILN_SPACE_*
  kiln_float y_scale;       // 1: green points up; -1: down
  kiln_uint two_sided;      // 1: normals that point away from the low poly are flipped
  kiln_uint padding;
} kiln_detail_params;
KILN_CHECK_SIZE(kiln_detail_params, 32);

#define KILN_MISS_KEEP 0
#define KILN_MISS_FILL 1
#define KILN_MISS_MARK 2

typedef struct kiln_resolve_params {
  kiln_uint texel_count;
  kiln_uint capacity;  // elements per component plane of the samples' values
  kiln_int miss;       // KILN_MISS_*
  kiln_uint padding;
} kiln_resolve_params;
KILN_CHECK_SIZE(kiln_resolve_params, 16);

#endif
