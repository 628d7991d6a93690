// Structs of the render family: pictures of meshes.
#ifndef KILN_SHARED_RENDER_H
#define KILN_SHARED_RENDER_H

#include "shared/common.h"

/// Pixels are processed in square tiles of this side, and the samples of a pixel are consecutive,
/// so that rays that are neighbours in memory are neighbours in the picture.
#define KILN_RENDER_TILE 8

/// Planes of the array of camera rays' hits.
#define KILN_SURFACE_POSITION 0 // 3 planes: position
#define KILN_SURFACE_FACE 3     // 3 planes: the face's unit normal, turned to the viewer
#define KILN_SURFACE_NORMAL 6   // 3 planes: the shading normal, flipped like the face's
#define KILN_SURFACE_PLANES 9

/// An orthographic camera in the mesh's frame, and the part of the picture that is drawn.
typedef struct kiln_render_params {
  kiln_float right[3];     // unit, to the picture's right
  kiln_float left_edge;    // coordinate along `right` of the picture's left edge
  kiln_float up[3];        // unit
  kiln_float top_edge;     // coordinate along `up` of the picture's top edge
  kiln_float toward[3];    // unit, from the scene to the viewer
  kiln_float pixel;        // side of a pixel
  kiln_uint width;         // width of the picture, pixels
  kiln_uint samples;       // N: N x N samples a pixel
  kiln_uint first_tile;    // first tile of this part
  kiln_uint tile_columns;  // tiles in a row of the picture
  kiln_uint pixel_count;   // pixels of this part, a multiple of a tile's
  kiln_uint sample_count;  // pixel_count * samples * samples
  kiln_uint capacity;      // elements per component plane of the samples' arrays
  kiln_uint flat;          // 1: shade by face normals
  kiln_uint show_normals;  // 1: write the normal as a colour
  kiln_uint ambient_passes;  // rays per sample for ambient occlusion; 0: none
  kiln_uint show_colors;     // 1: write the map's channels without lighting
  kiln_uint height;          // height of the picture, pixels
  // direction of the key light: unit, seen from the camera (right, up, towards the viewer)
  kiln_float key[3];
  // 1: write the depth towards the viewer, in frame units, and the coverage
  kiln_uint show_depth;
  kiln_float half_way[3];    // half vector: unit, between the key light and the viewer
  kiln_uint padding;
} kiln_render_params;
KILN_CHECK_SIZE(kiln_render_params, 128);

typedef struct kiln_render_map_params {
  kiln_uint count;     // number of samples
  kiln_uint capacity;  // elements per component plane of the samples' arrays
  kiln_uint width;     // width of the map, texels
  kiln_uint height;
  kiln_int space;      // KILN_SPACE_* (shared/detail.h), or KILN_RENDER_COLORS
  kiln_float y_scale;  // 1: green points up; -1: down
  kiln_uint padding[2];
} kiln_render_map_params;
KILN_CHECK_SIZE(kiln_render_map_params, 32);

/// The map holds colours instead of normals.
#define KILN_RENDER_COLORS 3

/// Maps are stored with 16 bits per channel, c * 65534 rounded to nearest: 0, 1/2 and 1 are exact.
#define KILN_RENDER_MAP_ONE 65534

#endif
