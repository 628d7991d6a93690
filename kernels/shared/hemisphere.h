// Structs of the hemisphere family: rays over the hemispheres of the high poly's points.
#ifndef KILN_SHARED_HEMISPHERE_H
#define KILN_SHARED_HEMISPHERE_H

#include "shared/common.h"

/// log2 of the number of rotations about the normal.
#define KILN_HEMISPHERE_TURN_BITS 10
#define KILN_HEMISPHERE_TURNS (1 << KILN_HEMISPHERE_TURN_BITS)

/// log2 of the number of ray sets, of which a sample uses one. Sets have different elevation angles, so that
/// neighbouring samples have independent errors.
#define KILN_HEMISPHERE_SET_BITS 3
#define KILN_HEMISPHERE_SETS (1 << KILN_HEMISPHERE_SET_BITS)

/// Samples per work-item.
#define KILN_HEMISPHERE_LANES 8

/// Number of component arrays of the points: position, unit normal, and the geometric normal multiplied by the offset
/// of ray origins.
#define KILN_HEMISPHERE_PLANES 9

struct kiln_hemisphere_params {
  kiln_uint first;         // first sample of this launch
  kiln_uint count;         // samples of this launch
  // number of samples in a row of rays: count rounded up to a multiple of the lanes
  kiln_uint stride;
  kiln_uint first_ray;     // first ray of each sample
  kiln_uint rays;          // rays per sample in this launch
  kiln_uint all_rays;      // rays per sample in total
  kiln_uint ray_capacity;  // elements per component plane of the rays
  kiln_uint low_capacity;  // elements per component plane of the low poly's samples
  kiln_uint hit_capacity;  // elements per component plane of the correspondence
  kiln_uint out_capacity;  // elements per component plane of the sums of directions
  kiln_uint keep;          // 1: misses use the point and the normal of the low poly
  kiln_uint two_sided;     // 1: normals that point away from the low poly are flipped
  kiln_float side;         // 1: hemispheres about the normal; -1: about the opposite direction
  kiln_float push;         // offset of origins from the face, frame units
  kiln_float reach;        // distance of maximum thickness, frame units
  kiln_uint aligned;       // 1: rays of a row have similar directions; 0: mixed directions
  // 1: rays around the light's direction, for samples that face it; 0: around the normal
  kiln_uint lit;
  kiln_float light_x;  // unit direction towards the light
  kiln_float light_y;
  kiln_float light_z;
  // 1: a sample's rays are consecutive; 0: a row of rays holds one of each sample
  kiln_uint by_sample;
  kiln_uint first_point;  // index of the first sample in the points
  kiln_uint plane;        // elements per component plane of the points
  // 1: computes the points of listed samples; 0: those of consecutive samples from `first` on
  kiln_uint by_list;
  kiln_uint unequal;      // 1: rays differ in length, and their directions are normalised for sums
};
typedef struct kiln_hemisphere_params kiln_hemisphere_params;
KILN_CHECK_SIZE(kiln_hemisphere_params, 100);

struct kiln_pick_params {
  kiln_uint count;         // number of picked samples
  kiln_uint low_capacity;  // elements per component plane of the low poly's samples
  kiln_uint hit_capacity;  // elements per component plane of the correspondence
  kiln_uint out_capacity;  // elements per component plane of all outputs
  // 1: rotations are computed from keys (kiln_hemisphere_write_keys); 0: rotations are copied
  kiln_uint by_key;
  kiln_uint round;         // if by_key: index of the round; each round has different rays
};
typedef struct kiln_pick_params kiln_pick_params;
KILN_CHECK_SIZE(kiln_pick_params, 24);

/// Parameters of kiln_hemisphere_cast: the shape of its blocks of rays.
struct kiln_cast_params {
  kiln_uint samples;  // samples per work-item, a multiple of the lanes
  // rows of rays cast at a time: samples * rows is at most KILN_OCCLUSION_BLOCK
  kiln_uint rows;
  kiln_uint wants_bent_sum;  // 1: also sum directions
};
typedef struct kiln_cast_params kiln_cast_params;
KILN_CHECK_SIZE(kiln_cast_params, 12);

struct kiln_rotation_params {
  kiln_uint texel_count;
  kiln_uint first_texel;  // index in the map of the band's first texel
  kiln_uint width;        // width of the map
  kiln_uint slot_bits;    // bits of a sample's index within a texel
};
typedef struct kiln_rotation_params kiln_rotation_params;
KILN_CHECK_SIZE(kiln_rotation_params, 16);

#endif
