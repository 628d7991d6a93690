// Padding: the exact nearest source texel of every empty texel within a radius.
//
// Algorithm: the exact Euclidean distance transform in two passes over columns and rows (Saito and
// Toriwaki 1994, "New algorithms for Euclidean distance transformation of an n-dimensional digitized
// picture with applications"), cut off at the radius. Column pass: for each texel the nearest source in
// its column, at offset dy. Row pass: the least dx^2 + dy^2 among the neighbouring columns. Both work on
// eight columns at once.
//
// Distance and offset travel in one integer, the key: d^2, then dy + bias, then dx + bias, from the
// highest bits down. The row pass is then one addition and one unsigned minimum per candidate, and ties
// go to the lowest row, then the lowest column. Integers only: the same on any device.
//
// | kernel                    | items                          | local | traffic an item              |
// | -------------------------- | ------------------------------ | ----- | ---------------------------- |
// | kiln_image_search_columns | stride/8 x ceil(rows/tile)     | 64    | 2 x 8 B x (tile + 2 radius)  |
// |                            |                                |       | read, 3 x 8 keys x tile      |
// | kiln_image_search_rows    | stride/8 x rows                | 64    | up to 8 keys x (2 radius + 1)|
// |                            |                                |       | read (cached), 8 offsets     |
//
// Defines: KILN_GUTTER_WIDE=0 (default) or 1: keys of 32 bits for a radius up to 127, or of 64 bits
// for one up to 16384.
// Limits: work grows with the radius where sources are far; groups of eight source texels cost nothing.
#include "lib/call.clh"
#include "shared/image.h"

#ifndef KILN_GUTTER_WIDE
#define KILN_GUTTER_WIDE 0
#endif

#if KILN_GUTTER_WIDE
typedef ulong gutter_key;
typedef ulong8 gutter_key8;
typedef uint gutter_offset;
#define GUTTER_SHIFT KILN_GUTTER_WIDE_SHIFT
#define GUTTER_FAR 0x7FFFFFFFul
#define to_key8 convert_ulong8
#define as_key8 as_ulong8
#define to_offset8 convert_uint8
#else
typedef uint gutter_key;
typedef uint8 gutter_key8;
typedef ushort gutter_offset;
#define GUTTER_SHIFT KILN_GUTTER_NARROW_SHIFT
#define GUTTER_FAR 0x7FFFu
#define to_key8 convert_uint8
#define as_key8 as_uint8
#define to_offset8 convert_ushort8
#endif
#define GUTTER_BIAS (1 << (GUTTER_SHIFT - 1))
#define GUTTER_DISTANCE_SHIFT (2 * GUTTER_SHIFT)
// The key for "no source". It is larger than the key of any distance, even after dx^2 is added, and that sum does not
// overflow.
#define GUTTER_NONE ((gutter_key)GUTTER_FAR << GUTTER_DISTANCE_SHIFT)

// Distance to the nearest source along the column: that of the previous texel plus 1, or 0 at a source; clamped to
// `limit`.
static int8 gutter_update_distance(int8 previous, uchar8 mask, int limit) {
  const int8 empty = convert_int8(mask) - 1;  // mask: all bits set for texels without a source, else 0
  return min(previous + 1, (int8)limit) & empty;
}

/// Keys of the nearest source in each column. mask: [height][stride], 1 for a source, else 0.
/// keys: [row_count][pad + stride + pad]; the caller fills the pad columns with bytes of 0x7F,
/// larger than any distance.
static KILN_CALL void gutter_search_columns(const uint item, const kiln_gutter_band band,
                                            global const uchar* KILN_CALL_RESTRICT mask,
                                            global gutter_key* KILN_CALL_RESTRICT keys) {
  const uint groups = band.stride / 8;
  const uint first = item / groups * band.tile_rows;
  if (first >= band.row_count) return;
  const uint x = item % groups * 8;
  const uint last = min(first + band.tile_rows, band.row_count);
  const int limit = (int)band.radius + 1;
  const size_t key_stride = (size_t)band.stride + 2 * band.pad;
  const int top = (int)(band.first_row + first);
  const int bottom = (int)(band.first_row + last);  // one past the last row

  // Upward pass: stores the distance to the nearest source below in place of the key.
  int8 distance_below = (int8)limit;
  for (int y = min(bottom - 1 + (int)band.radius, (int)band.height - 1); y >= top; --y) {
    distance_below = gutter_update_distance(distance_below, vload8(0, mask + (size_t)y * band.stride + x), limit);
    if (y < bottom) {
      vstore8(to_key8(distance_below), 0,
              keys + (size_t)(y - (int)band.first_row) * key_stride + band.pad + x);
    }
  }
  // Downward pass: computes the distance to the nearest source above, and stores the nearer of the two sources; the
  // upper one wins ties.
  int8 distance_above = (int8)limit;
  for (int y = max(top - (int)band.radius, 0); y < bottom; ++y) {
    distance_above = gutter_update_distance(distance_above, vload8(0, mask + (size_t)y * band.stride + x), limit);
    if (y < top) continue;
    global gutter_key* key = keys + (size_t)(y - (int)band.first_row) * key_stride + band.pad + x;
    distance_below = convert_int8(vload8(0, key));
    const int8 distance = min(distance_above, distance_below);
    const int8 offset = select(distance_below, -distance_above, distance_above <= distance_below);
    const gutter_key8 nearest_key =
        (to_key8(distance * distance) << GUTTER_DISTANCE_SHIFT) |
        (to_key8(offset + GUTTER_BIAS) << GUTTER_SHIFT);
    // Mask: all bits are set for texels without a source, none for others.
    const gutter_key8 no_source = (gutter_key8)0 - to_key8((uint8)1 & as_uint8(distance >= limit));
    vstore8((nearest_key & ~no_source) | ((gutter_key8)GUTTER_NONE & no_source), 0, key);
  }
}

kernel void kiln_image_search_columns(const kiln_gutter_band band,
                                      global const uchar* restrict mask,
                                      global gutter_key* restrict keys) {
  gutter_search_columns((uint)get_global_id(0), band, mask, keys);
}

static gutter_key gutter_find_largest(gutter_key8 keys) {
  const gutter_key8 a = max(keys, keys.s45670123);
  const gutter_key8 b = max(a, a.s23016745);
  return max(b.s0, b.s1);
}

/// Offsets to the nearest source; 0 on sources, and for texels without a source within the
/// radius. offsets: [row_count][stride].
static KILN_CALL void gutter_search_rows(const uint item, const kiln_gutter_band band,
                                         global const uchar* KILN_CALL_RESTRICT mask,
                                         global const gutter_key* KILN_CALL_RESTRICT keys,
                                         global gutter_offset* KILN_CALL_RESTRICT offsets) {
  const uint groups = band.stride / 8;
  const uint row = item / groups;
  if (row >= band.row_count) return;
  const uint x = item % groups * 8;
  const uchar8 source = vload8(0, mask + (size_t)(band.first_row + row) * band.stride + x);
  global gutter_offset* out = offsets + (size_t)row * band.stride + x;
  if (as_ulong(source) == 0x0101010101010101ul) {
    vstore8(to_offset8((uint8)0), 0, out);
    return;
  }
  const size_t key_stride = (size_t)band.stride + 2 * band.pad;
  global const gutter_key* at = keys + (size_t)row * key_stride + band.pad + x;
  const gutter_key radius = (gutter_key)band.radius;
  gutter_key8 best = vload8(0, at) + (gutter_key)GUTTER_BIAS;
  for (gutter_key dx = 1; dx <= radius; ++dx) {
    const gutter_key far = (dx * dx << GUTTER_DISTANCE_SHIFT) + (gutter_key)GUTTER_BIAS;
    // The search ends when columns farther away cannot hold a nearer source. This is tested every 8 columns, since the
    // test costs as much as a column.
    if ((dx & 7) == 0 && gutter_find_largest(best) < far - (gutter_key)GUTTER_BIAS) break;
    best = min(best, vload8(0, at - dx) + (far - dx));
    best = min(best, vload8(0, at + dx) + (far + dx));
  }
  const gutter_key8 squared = best >> GUTTER_DISTANCE_SHIFT;
  const gutter_key8 low = best & (((gutter_key)1 << GUTTER_DISTANCE_SHIFT) - 1);
  const gutter_key8 in_radius = (gutter_key8)1 & as_key8(squared <= radius * radius);
  vstore8(to_offset8(low * in_radius * (1 - to_key8(source))), 0, out);
}

kernel void kiln_image_search_rows(const kiln_gutter_band band,
                                   global const uchar* restrict mask,
                                   global const gutter_key* restrict keys,
                                   global gutter_offset* restrict offsets) {
  gutter_search_rows((uint)get_global_id(0), band, mask, keys, offsets);
}
