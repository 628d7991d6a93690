// Structs of the hemisphere family: rays over the hemispheres of the high poly's points.
#ifndef KILN_SHARED_HEMISPHERE_H
#define KILN_SHARED_HEMISPHERE_H

#include "shared/common.h"

/// Into how many angles a full turn about the normal is cut.
#define KILN_HEMISPHERE_TURN_BITS 10
#define KILN_HEMISPHERE_TURNS (1 << KILN_HEMISPHERE_TURN_BITS)

/// Sets of rays, of which a sample has one: they differ in how far rays lean, so that errors do not line up.
#define KILN_HEMISPHERE_SET_BITS 3
#define KILN_HEMISPHERE_SETS (1 << KILN_HEMISPHERE_SET_BITS)

/// Samples that a work-item takes at once.
#define KILN_HEMISPHERE_LANES 8

/// Planes of the points: position, unit normal, and the geometric normal times how far rays are pushed.
#define KILN_HEMISPHERE_PLANES 9

struct kiln_hemisphere_params {
  kiln_uint first;         // first sample of this launch
  kiln_uint count;         // its samples
  kiln_uint stride;        // count rounded up to lanes: samples of a row of rays
  kiln_uint first_ray;     // of a sample
  kiln_uint rays;          // of a sample, in this launch
  kiln_uint all_rays;      // of a sample, in all
  kiln_uint ray_capacity;  // elements of one plane of the rays
  kiln_uint low_capacity;  // ... of the low poly's samples
  kiln_uint hit_capacity;  // ... of the correspondence
  kiln_uint out_capacity;  // ... of sums of directions
  kiln_uint keep;          // 1: where nothing was found the low poly's own point and normal stand in
  kiln_uint two_sided;     // 1: normals that point away from the low poly are turned to it
  kiln_float side;         // 1: hemispheres about the normal; -1: about its opposite
  kiln_float push;         // how far origins lie off the face, frame units
  kiln_float reach;        // distances from which on a place is as thick as can be, frame units
  kiln_uint aligned;       // 1: rays of a row run in about one direction; 0: in all
  kiln_uint lit;           // 1: rays run about the light, of samples that face it; 0: about the normal
  kiln_float light_x;      // unit, towards the light
  kiln_float light_y;
  kiln_float light_z;
  kiln_uint by_sample;  // 1: a sample's rays lie one after another; 0: a row of rays holds one of each sample
  kiln_uint first_point;  // of the first sample, in the points
  kiln_uint plane;        // elements of one plane of the points
  kiln_uint by_list;      // 1: points of samples that are listed; 0: of those from `first` on
  kiln_uint unequal;      // 1: rays differ in length, and sums take their unit directions
};
typedef struct kiln_hemisphere_params kiln_hemisphere_params;
KILN_CHECK_SIZE(kiln_hemisphere_params, 100);

struct kiln_pick_params {
  kiln_uint count;         // samples picked
  kiln_uint low_capacity;  // elements of one plane of the low poly's samples
  kiln_uint hit_capacity;  // ... of the correspondence
  kiln_uint out_capacity;  // ... of all that is written
  kiln_uint by_key;        // 1: turns are made of keys (kiln_hemisphere_keys); 0: copied
  kiln_uint round;         // by key: other rays in each round
};
typedef struct kiln_pick_params kiln_pick_params;
KILN_CHECK_SIZE(kiln_pick_params, 24);

/// Modes of kiln_hemisphere_cast.
struct kiln_cast_params {
  kiln_uint samples;     // of a work-item, whole lanes
  kiln_uint rows;        // of rays, cast at a time: samples * rows is KILN_OCCLUSION_BLOCK at most
  kiln_uint wants_bent_sum;  // 1: directions are added up too
};
typedef struct kiln_cast_params kiln_cast_params;
KILN_CHECK_SIZE(kiln_cast_params, 12);

struct kiln_turn_params {
  kiln_uint texel_count;
  kiln_uint first_texel;  // place in the map of the band's first texel
  kiln_uint width;        // of the map
  kiln_uint slot_bits;    // that places within a texel need
};
typedef struct kiln_turn_params kiln_turn_params;
KILN_CHECK_SIZE(kiln_turn_params, 16);

#endif
