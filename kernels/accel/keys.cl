// Keys: merges depth views that are drawn part by part.
//
// A mesh that is larger than memory is drawn in parts of consecutive triangles, each into a view of its own. Keys of
// depth and triangle are totally ordered, so the least of a pixel's keys over all parts is that of the whole mesh,
// whatever the parts (a z-buffer's property: Catmull 1974, "A subdivision algorithm for computer display of curved
// surfaces").
//
// kernel           global      local  memory traffic
// kiln_keys_merge  pixels / 8  64     reads 16 B, writes 8 B a pixel of a drawn tile
//
// Limits: both views have the same size, and their sizes are multiples of a tile's.
#include "accel/keys.clh"

#define KEYS_ITEM 8u  // keys of a work-item

/// Merges the view of a part.
/// \param first           index of the merged view's first key
/// \param first_triangle  index in the mesh of the part's first triangle
/// \param begins          1: the merged view is undefined so far
kernel void kiln_keys_merge(const uint first, const uint count, const uint first_triangle,
                            const uint begins, global const ulong* restrict part,
                            global const uchar* restrict part_drawn, global ulong* restrict keys,
                            global uchar* restrict drawn) {
  const uint i = (uint)get_global_id(0) * KEYS_ITEM;
  if (i >= count) return;
  const uint tile = i / KILN_RASTER_TILE_PIXELS;
  const bool is_drawn = part_drawn[tile] != 0;
  if (begins == 0 && !is_drawn) return;
  if (begins != 0 && i % KILN_RASTER_TILE_PIXELS == 0) drawn[first / KILN_RASTER_TILE_PIXELS + tile] = 1;
  for (uint k = i; k < i + KEYS_ITEM; ++k) {
    const ulong own = is_drawn ? part[k] : KILN_RASTER_EMPTY;
    const ulong moved = own == KILN_RASTER_EMPTY ? own : own + first_triangle;
    keys[first + k] = begins != 0 ? moved : min(keys[first + k], moved);
  }
}
