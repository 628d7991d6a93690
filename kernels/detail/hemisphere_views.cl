// Hemispheres by depth views: each sample is looked up in depth pictures of the occluders from all around.
//
// Tarini, Cignoni and Scopigno gather visibility this way ("Visibility Based Methods and Assessment for
// Detail-Recovery", 2003, section 3.3). Here the visibility of the high poly's point is tested. Directions are
// weighted by their cosine to the normal. Ambient occlusion is the weight of the open directions divided by
// that of all directions over the hemisphere, so an open place is 1 for any number of directions.
//
// kernel                         global        local  memory traffic an item
// kiln_hemisphere_unpack_depths  rows of tiles 64     reads 512 B, writes 256 B
// kiln_hemisphere_add_views      samples / 64  64     a sample: reads 36 B + 4 B a view (gathered), 44 B of sums
//
// Defines: KILN_VISIBILITY_SCALAR  one sample an item: for GPUs
//          KILN_HEMISPHERE_BENT_SUM    also sums the open directions
//          KILN_LANES, KILN_PORTABLE_MASKS  as in lib/vector.clh, lib/mask.clh
//
// Strengths: a sample costs a projection and one pixel read per view; all samples share their directions, so there is
// no noise. Limits: occluders narrower than a pixel may be missed; contacts closer than a pixel are always missed; few
// directions cause banding.
#include "accel/keys.clh"
#include "lib/vector3.clh"
#include "accel/visibility_lanes.clh"
#include "shared/common.h"
#include "shared/hemisphere.h"
#include "shared/hemisphere_views.h"
#include "shared/raster.h"
#include "shared/visibility.h"

/// Converts a batch of views from keys, tile by tile, to depths, row by row. An item handles a row
/// of one tile.
/// \param views  side by side, of a size that is a multiple of KILN_RASTER_TILE
kernel void kiln_hemisphere_unpack_depths(const kiln_hemisphere_views_params params,
                                          global const kiln_view* restrict views,
                                          global const ulong* restrict keys,
                                          global const uchar* restrict drawn,
                                          global float* restrict depths) {
  const uint i = (uint)get_global_id(0);
  const uint size = params.view_size;
  const uint tiles = KILN_RASTER_TILES(size);
  if (i >= params.view_count * size * tiles) return;
  const uint view = i / (size * tiles);
  const uint y = i / tiles % size;
  const uint first = keys_index(views[view].first, size, i % tiles * KILN_RASTER_TILE, y);
  const bool is_tile_drawn = drawn[first / KILN_RASTER_TILE_PIXELS] != 0;
  global float* to = depths + (size_t)i * KILN_RASTER_TILE;
  for (uint x = 0; x < KILN_RASTER_TILE; x += 8) {
    float8 depth = (float8)(KILN_VISIBILITY_FAR);
    if (is_tile_drawn) {
      const ulong8 key = vload8(0, keys + first + x);
      const float8 picture_depth = as_float8(convert_uint8(key >> 32));
      depth = select(picture_depth, depth, convert_uint8(key >> 32) == (uint8)(0xFFFFFFFFu));
    }
    vstore8(depth, 0, to + x);
  }
}

/// Adds a batch of views to samples. A view sees a sample if the sample's pixel shows nothing nearer
/// than the plane of the sample's face, both at the pixel's centre.
/// \param points  position, unit normal (0: no hemisphere) and the face's normal of any length, 9 planes
/// \param sums    KILN_HEMISPHERE_VIEW_SUMS planes
/// \param bent_sum    3 planes of bent_sum_plane elements: directions weighted by their cosines
kernel void kiln_hemisphere_add_views(const kiln_hemisphere_views_params params,
                                      global const kiln_view* restrict views,
                                      global const float* restrict depths,
                                      global const float* restrict points,
                                      global float* restrict sums
#ifdef KILN_HEMISPHERE_BENT_SUM
                                      ,
                                      global float* restrict bent_sum
#endif
) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t plane = params.capacity;
#if VISIBILITY_LANES == 1
  const size_t base = get_global_id(0);
  const int vectors = 1;
#else
  const size_t base = get_global_id(0) * KILN_VISIBILITY_SAMPLES;
  const int vectors = KILN_VISIBILITY_SAMPLES / VISIBILITY_LANES;
#endif
  if (base >= params.count) return;
  const int last = (int)params.view_size - 1;
  const float min_squared = KILN_VISIBILITY_LEAST_COSINE * KILN_VISIBILITY_LEAST_COSINE;
  for (int j = 0; j < vectors; ++j) {
    const size_t at = base + j * VISIBILITY_LANES;
    global const float* sample = points + at;
    const vfloat nx = visibility_load(sample + 3 * plane);
    const vfloat ny = visibility_load(sample + 4 * plane);
    const vfloat nz = visibility_load(sample + 5 * plane);
    if (!visibility_any((nx != (vfloat)(0.0f)) | (ny != (vfloat)(0.0f)) | (nz != (vfloat)(0.0f)))) {
      continue;
    }
    const vfloat px = visibility_load(sample) * params.scale;
    const vfloat py = visibility_load(sample + plane) * params.scale;
    const vfloat pz = visibility_load(sample + 2 * plane) * params.scale;
    const vfloat gx = visibility_load(sample + 6 * plane);
    const vfloat gy = visibility_load(sample + 7 * plane);
    const vfloat gz = visibility_load(sample + 8 * plane);
    const vfloat size = sqrt((gx * gx + gy * gy) + gz * gz);
    const vfloat fx = gx / size, fy = gy / size, fz = gz / size;
    vfloat open_even = visibility_load(sums + at);
    vfloat open_odd = visibility_load(sums + at + plane);
    vfloat all_even = visibility_load(sums + at + 2 * plane);
    vfloat all_odd = visibility_load(sums + at + 3 * plane);
#ifdef KILN_HEMISPHERE_BENT_SUM
    const size_t bent_sum_plane = params.bent_sum_plane;
    vfloat along_x = visibility_load(bent_sum + at);
    vfloat along_y = visibility_load(bent_sum + at + bent_sum_plane);
    vfloat along_z = visibility_load(bent_sum + at + 2 * bent_sum_plane);
#endif
    for (uint k = 0; k < params.view_count; ++k) {
      global const kiln_view* view = views + k;
      const float tx = view->toward[0], ty = view->toward[1], tz = view->toward[2];
      const vfloat cosine = (nx * tx + ny * ty) + nz * tz;
      const vint faces_view = cosine > (vfloat)(0.0f);
      if (!visibility_any(faces_view)) continue;
      const float rx = view->right[0], ry = view->right[1], rz = view->right[2];
      const float ux = view->up[0], uy = view->up[1], uz = view->up[2];
      const vfloat x = ((px * rx + py * ry) + pz * rz) * view->scale + view->left;
      const vfloat y = view->top - ((px * ux + py * uy) + pz * uz) * view->scale;
      const vfloat depth = KILN_RASTER_FAR - ((px * tx + py * ty) + pz * tz);
      const vint column = clamp(visibility_to_int(x), (vint)(0), (vint)(last));
      const vint row = clamp(visibility_to_int(y), (vint)(0), (vint)(last));
      const vfloat offset_x = (visibility_to_float(column) + 0.5f) - x;
      const vfloat offset_y = (visibility_to_float(row) + 0.5f) - y;
      const vfloat facing = (fx * tx + fy * ty) + fz * tz;
      const vfloat slope_x = (fx * rx + fy * ry) + fz * rz;
      const vfloat slope_y = (fx * ux + fy * uy) + fz * uz;
      global const float* picture = depths + (size_t)k * params.view_size * params.view_size;
      const vfloat picture_depth = visibility_gather(picture, row * (last + 1) + column);
      // Pictures cover all occluders: points outside of the picture are unoccluded.
      const vint outside = max(offset_x * offset_x, offset_y * offset_y) > (vfloat)(1.0f);
      // Both sides of the comparison are multiplied by the cosine, so that the face's orientation does not matter.
      const vfloat squared = facing * facing;
      const vint seen = (squared > (vfloat)(min_squared)) &
                        ((slope_x * offset_x - slope_y * offset_y) * facing <=
                         ((picture_depth + params.bias) - depth) * (squared * view->scale));
      const vfloat share = (faces_view & (seen | outside)) ? cosine : (vfloat)(0.0f);
      const vfloat weight = faces_view ? cosine : (vfloat)(0.0f);
      if (((params.first_view + k) & 1u) == 0u) {
        open_even += share;
        all_even += weight;
      } else {
        open_odd += share;
        all_odd += weight;
      }
#ifdef KILN_HEMISPHERE_BENT_SUM
      along_x += share * tx;
      along_y += share * ty;
      along_z += share * tz;
#endif
    }
    visibility_store(open_even, sums + at);
    visibility_store(open_odd, sums + at + plane);
    visibility_store(all_even, sums + at + 2 * plane);
    visibility_store(all_odd, sums + at + 3 * plane);
#ifdef KILN_HEMISPHERE_BENT_SUM
    visibility_store(along_x, bent_sum + at);
    visibility_store(along_y, bent_sum + at + bent_sum_plane);
    visibility_store(along_z, bent_sum + at + 2 * bent_sum_plane);
#endif
  }
}
