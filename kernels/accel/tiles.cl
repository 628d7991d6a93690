// Tiles: draws depth views on CPUs, the same pictures as raster.cl to the bit, without atomics.
//
// Sort-middle rasterisation (Molnar et al. 1994, "A sorting classification of parallel rendering"; for CPUs:
// Seiler et al. 2008, "Larrabee", section 4): a work-item owns a tile of the picture and draws all triangles
// that overlap it into private memory. Chunks of 32 triangles are sorted instead of triangles, and their
// boxes are computed once per mesh: a view costs one projected box per chunk, and chunks whose triangles all
// face away (cone of normals: Shirman and Abi-Ezzi 1993, "The cone of normals technique") are culled there.
// Within a chunk, vertices are projected and triangles set up 16 at a time, one per lane; triangles that
// span up to 2 x 2 pixels are also drawn one per lane. Larger ones are drawn by rows of 8 pixels with the
// edge functions of raster.cl (Pineda 1988).
//
// kernel                     global                 local  memory traffic
// kiln_tiles_compute_bounds  views * chunks / 16    64     reads 44 B, writes 8 B a chunk
// kiln_tiles_draw            views * tiles          1      8 B a 16 chunks; 640 B a chunk in it; writes 8 B a pixel
//
// Strengths: no atomics, and the pixels stay in the first-level cache; empty tiles cost a byte. Limits: an
// item needs 40 KiB of private memory, which GPUs lack; views up to 16384 pixels a side.
#include "accel/prefetch.clh"
#include "accel/tile.clh"

#define TILE_LANES KILN_RASTER_BOXES

/// Computes the chunks' boxes in a view. The boxes are conservative: raster.cl draws no pixel of a chunk
/// outside of its box.
///
/// A vertex's pixel coordinates differ from the exact ones by the snapping (1/512) and by rounding, less
/// than 2^-24 (10 scale |p| + offset). The box is enlarged by a whole pixel. A chunk is culled if no
/// triangle in it can have a positive area on the screen. Let d be the error of a coordinate in pixels,
/// l a triangle's longest edge in pixels: the error of the triangle's doubled area is less than 6 d l +
/// 8 d^2. Let n be the cosine between the triangle's normal and the viewer, h its height on the longest
/// edge in frame units, and q = d / (scale h): the triangle certainly faces away if -n >= 6 q + 8 q^2.
kernel void kiln_tiles_compute_bounds(const uint view_count, const uint group_count,
                                      const uint padded_groups, global const kiln_view* restrict views,
                                      global const kiln_raster_bounds* restrict bounds,
                                      global kiln_raster_boxes* restrict boxes,
                                      global kiln_raster_boxes* restrict group_boxes) {
#pragma OPENCL FP_CONTRACT OFF
  const uint i = (uint)get_global_id(0);
  if (i >= view_count * padded_groups) return;
  global const kiln_view* view = views + i / padded_groups;
  const uint group = i % padded_groups;
  global kiln_raster_boxes* group_box = group_boxes + i / TILE_LANES;
  const uint lane = i % TILE_LANES;
  if (group >= group_count) {
    group_box->first_x[lane] = group_box->first_y[lane] = KILN_RASTER_LARGEST;
    group_box->last_x[lane] = group_box->last_y[lane] = -1;
    return;
  }
  global const kiln_raster_bounds* b = bounds + group;
  const float16 cx = TILE_FLOATS(b->centre[0], 0);
  const float16 cy = TILE_FLOATS(b->centre[1], 0);
  const float16 cz = TILE_FLOATS(b->centre[2], 0);
  const float16 hx = TILE_FLOATS(b->half_extent[0], 0);
  const float16 hy = TILE_FLOATS(b->half_extent[1], 0);
  const float16 hz = TILE_FLOATS(b->half_extent[2], 0);
  const float scale = view->scale;
  const float3 right = vload3(0, view->right);
  const float3 up = vload3(0, view->up);
  const float16 reach = ((fabs(cx) + fabs(cy)) + fabs(cz)) + ((hx + hy) + hz);
  const float16 rounding = 6e-7f * scale * reach + 6e-8f * (fabs(view->left) + fabs(view->top));
  const float16 x = (right.x * cx + right.y * cy + right.z * cz) * scale + view->left;
  const float16 y = view->top - (up.x * cx + up.y * cy + up.z * cz) * scale;
  const float16 margin = 1.0f + 2.0f * rounding;
  const float16 reach_x =
      (fabs(right.x) * hx + fabs(right.y) * hy + fabs(right.z) * hz) * scale + margin;
  const float16 reach_y = (fabs(up.x) * hx + fabs(up.y) * hy + fabs(up.z) * hz) * scale + margin;
  const float16 last_column = (float16)((float)view->width - 1.0f);
  const float16 last_row = (float16)((float)view->height - 1.0f);
  const float16 minus_one = (float16)(-1.0f);
  const int16 first_x =
      convert_int16(clamp(floor(x - reach_x), (float16)(0.0f), last_column + 1.0f));
  const int16 first_y = convert_int16(clamp(floor(y - reach_y), (float16)(0.0f), last_row + 1.0f));
  int16 last_x = convert_int16(clamp(floor(x + reach_x), minus_one, last_column));
  const int16 last_y = convert_int16(clamp(floor(y + reach_y), minus_one, last_row));
  if ((view->flags & KILN_RASTER_TWO_SIDED) == 0) {
    const float facing_x = right.y * up.z - right.z * up.y;
    const float facing_y = right.z * up.x - right.x * up.z;
    const float facing_z = right.x * up.y - right.y * up.x;
    const float16 cosine = TILE_FLOATS(b->cosine, 0);
    const float16 height = TILE_FLOATS(b->height, 0);
    const float16 n = facing_x * TILE_FLOATS(b->axis[0], 0) +
                      facing_y * TILE_FLOATS(b->axis[1], 0) + facing_z * TILE_FLOATS(b->axis[2], 0);
    const float16 q = (0.002f + rounding) / (scale * height);
    // Largest cosine between the cone's normals and the direction to the viewer. Square roots of small
    // numbers have errors of up to 5e-4, so the test adds a margin of 1e-3.
    const float16 max_cosine =
        n * cosine + sqrt(max(1.0f - n * n, (float16)(0.0f))) * sqrt(1.0f - cosine * cosine);
    const int16 is_turned_away = (cosine >= 0.0f) & (max_cosine + 1e-3f <= -(6.0f * q + 8.0f * q * q));
    last_x = is_turned_away ? (int16)(-1) : last_x;
  }
  global kiln_raster_boxes* box = boxes + (i / padded_groups) * group_count + group;
  vstore16(convert_short16(first_x), 0, box->first_x);
  vstore16(convert_short16(first_y), 0, box->first_y);
  vstore16(convert_short16(last_x), 0, box->last_x);
  vstore16(convert_short16(last_y), 0, box->last_y);
  // Computes the union of those of the 16 boxes that are not empty.
  const int16 empty = (first_x > last_x) | (first_y > last_y);
  const int16 low_x = empty ? (int16)(KILN_RASTER_LARGEST) : first_x;
  const int16 low_y = empty ? (int16)(KILN_RASTER_LARGEST) : first_y;
  const int16 high_x = empty ? (int16)(-1) : last_x;
  const int16 high_y = empty ? (int16)(-1) : last_y;
  const int8 lx = min(low_x.lo, low_x.hi), ly = min(low_y.lo, low_y.hi);
  const int8 gx = max(high_x.lo, high_x.hi), gy = max(high_y.lo, high_y.hi);
  const int4 lx4 = min(lx.lo, lx.hi), ly4 = min(ly.lo, ly.hi);
  const int4 gx4 = max(gx.lo, gx.hi), gy4 = max(gy.lo, gy.hi);
  group_box->first_x[lane] = (short)min(min(lx4.x, lx4.y), min(lx4.z, lx4.w));
  group_box->first_y[lane] = (short)min(min(ly4.x, ly4.y), min(ly4.z, ly4.w));
  group_box->last_x[lane] = (short)max(max(gx4.x, gx4.y), max(gx4.z, gx4.w));
  group_box->last_y[lane] = (short)max(max(gy4.x, gy4.y), max(gy4.z, gy4.w));
}

/// Finds the boxes, among 16, that overlap the tile. \returns one bit per box
static inline uint tile_find_overlaps(global const kiln_raster_boxes* boxes, const tile_state* tile) {
  const short16 hits = (TILE_SHORTS(boxes->first_x) <= (short16)((short)tile->last_x)) &
                       (TILE_SHORTS(boxes->last_x) >= (short16)((short)tile->first_x)) &
                       (TILE_SHORTS(boxes->first_y) <= (short16)((short)tile->last_y)) &
                       (TILE_SHORTS(boxes->last_y) >= (short16)((short)tile->first_y));
  return mask_bits16(convert_int16(hits));
}

/// Draws views of one size. \param drawn one byte per tile: 1 if the tile has a drawn pixel; else 0, and
/// its keys are not written
kernel void kiln_tiles_draw(const uint count, const uint group_count, const uint padded_groups,
                            global const kiln_view* restrict views,
                            global const kiln_raster_boxes* restrict boxes,
                            global const kiln_raster_boxes* restrict group_boxes,
                            global const kiln_raster_chunk* restrict chunks,
                            global ulong* restrict keys, global uchar* restrict drawn) {
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  const uint tile_columns = KILN_RASTER_TILES(views->width);
  const uint tiles = tile_columns * KILN_RASTER_TILES(views->height);
  const kiln_view view = views[i / tiles];
  const uint index = i % tiles;
  boxes += (i / tiles) * group_count;
  group_boxes += (i / tiles) * (padded_groups / TILE_LANES);
  tile_state tile;
  tile.first_x = (int)(index % tile_columns * KILN_RASTER_TILE);
  tile.first_y = (int)(index / tile_columns * KILN_RASTER_TILE);
  tile.last_x = min(tile.first_x + KILN_RASTER_TILE, (int)view.width) - 1;
  tile.last_y = min(tile.first_y + KILN_RASTER_TILE, (int)view.height) - 1;
  tile.drawn = 0;
  bool cleared = false;
  for (uint s = 0; s < padded_groups; s += TILE_LANES) {
    for (uint group_hits = tile_find_overlaps(group_boxes + s / TILE_LANES, &tile); group_hits != 0;
         group_hits &= group_hits - 1) {
      const uint group = s + mask_lowest(group_hits);
      for (uint hits = tile_find_overlaps(boxes + group, &tile); hits != 0; hits &= hits - 1) {
        if (!cleared) {
          for (uint k = 0; k < KILN_RASTER_TILE_PIXELS / 8; ++k) {
            vstore8((ulong8)(KILN_RASTER_EMPTY), k, tile.keys);
          }
          cleared = true;
        }
        const uint remaining = hits & (hits - 1);
        global const kiln_raster_chunk* chunk = chunks + group * TILE_LANES;
        if (remaining != 0) prefetch_lines(chunk + mask_lowest(remaining), sizeof(kiln_raster_chunk) / 64);
        tile_draw_chunk(&view, chunk + mask_lowest(hits), &tile);
      }
    }
  }
  drawn[view.first / KILN_RASTER_TILE_PIXELS + index] = (uchar)tile.drawn;
  if (tile.drawn == 0) return;
  global ulong* target = keys + view.first + index * KILN_RASTER_TILE_PIXELS;
  for (uint k = 0; k < KILN_RASTER_TILE_PIXELS / 8; ++k) {
    vstore8(vload8(k, tile.keys), k, target);
  }
}
