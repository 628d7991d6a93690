// Raster: software z-buffer of depth and triangle id, orthographic, for matching by views. The variant
// for GPUs; tiles.cl draws the same pictures on CPUs.
//
// Pineda 1988, "A parallel algorithm for polygon rasterization": edge functions, here in fixed
// point, so that coverage is exact. Vertices are snapped once, to 1/256 of a pixel, and shared; by
// the top-left rule a pixel centre on an edge belongs to exactly one of the two triangles: no pixel
// is missed or drawn twice. Both kernels interpolate the depth at a pixel by the same expression.
// The smallest key (depth, then triangle) wins: the picture depends on the mesh and the view alone.
//
// kernel                  global             local  memory traffic
// kiln_raster_clear       pixels / 8, up     64     writes 8 B a pixel
// kiln_raster_project     vertices           64     reads 12 B, writes 16 B a vertex
// kiln_raster_draw_small  triangles          64     reads 12 B + 48 B (gathered); 8 B a pixel
// kiln_raster_draw_large  64 * 64            64     reads the list once a band; 8 B a pixel
//
// Defines: KILN_RASTER_ATOMIC64  the device has 64-bit atomics. Else `pass` 0 takes the least depth
//                                and pass 1 finds, over the same triangles, the lowest one of that
//                                depth.
//
// Strengths: a triangle without a pixel centre costs three vertex reads. Limits: triangles larger than
// 32 pixels are queued for a second kernel; views up to 16384 pixels a side; ids below 2^32 - 1.
#include "accel/keys.clh"
#include "lib/mask.clh"
#include "accel/raster.clh"
#include "shared/raster.h"

#ifdef KILN_RASTER_ATOMIC64
#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable
#pragma OPENCL EXTENSION cl_khr_int64_extended_atomics : enable
typedef ulong raster_key;
#else
typedef uint2 raster_key;  // x: triangle, y: depth
#endif

/// Clears 8 keys per item, and marks the tiles as drawn. `count`: number of pixels, a multiple of a tile's.
kernel void kiln_raster_clear(const uint first, const uint count, global ulong* restrict keys,
                              global uchar* restrict drawn) {
  const uint i = (uint)get_global_id(0) * 8u;
  if (i >= count) return;
  vstore8((ulong8)(KILN_RASTER_EMPTY), 0, keys + first + i);
  if (i % KILN_RASTER_TILE_PIXELS == 0) drawn[(first + i) / KILN_RASTER_TILE_PIXELS] = 1;
}

/// Converts vertices to fixed point; w is 1 for vertices outside the range that views cover (the test
/// of is_in_views() on the host).
kernel void kiln_raster_project(const kiln_view view, const uint count,
                                global const float* restrict positions,
                                global int4* restrict projected) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= count) return;
  const float3 p = vload3(i, positions);
  const float along_x = (view.right[0] * p.x + view.right[1] * p.y) + view.right[2] * p.z;
  const float along_y = (view.up[0] * p.x + view.up[1] * p.y) + view.up[2] * p.z;
  const float toward_viewer = (view.toward[0] * p.x + view.toward[1] * p.y) + view.toward[2] * p.z;
  const float x = along_x * view.scale + view.left;
  const float y = view.top - along_y * view.scale;
  // NaN fails these comparisons.
  const bool in_view = fabs(p.x) <= 4.0f && fabs(p.y) <= 4.0f && fabs(p.z) <= 4.0f &&
                    fabs(x) <= 32768.0f && fabs(y) <= 32768.0f && fabs(toward_viewer) <= 0.75f;
  const int fixed_x = in_view ? (int)rint(x * (float)KILN_RASTER_UNIT) : 0;
  const int fixed_y = in_view ? (int)rint(y * (float)KILN_RASTER_UNIT) : 0;
  projected[i] = (int4)(fixed_x, fixed_y, as_int(KILN_RASTER_FAR - toward_viewer), in_view ? 0 : 1);
}

/// A triangle whose corners are ordered so that its area is positive; row indices grow downwards.
typedef struct {
  int4 a, b, c;
  int x0, y0, x1, y1;  // bounds of the pixels whose centres lie in the triangle's bounding box
} raster_triangle;

/// Loads a triangle and its pixels. Returns false if there is nothing to draw.
static inline bool raster_fetch(const kiln_view* view, uint triangle,
                                global const uint* restrict triangles,
                                global const int4* restrict projected, raster_triangle* out) {
  const uint3 index = vload3(triangle, triangles);
  const int4 a = projected[index.x];
  const int4 b = projected[index.y];
  const int4 c = projected[index.z];
  const int4 lo = min(a, min(b, c));
  const int4 hi = max(a, max(b, c));
  // Centres lie at 256 i + 128.
  out->x0 = max((lo.x + 127) >> KILN_RASTER_SHIFT, 0);
  out->y0 = max((lo.y + 127) >> KILN_RASTER_SHIFT, 0);
  out->x1 = min((hi.x - 128) >> KILN_RASTER_SHIFT, (int)view->width - 1);
  out->y1 = min((hi.y - 128) >> KILN_RASTER_SHIFT, (int)view->height - 1);
  if (out->x0 > out->x1 || out->y0 > out->y1 || hi.w != 0) return false;
  const long area = (long)(b.x - a.x) * (c.y - a.y) - (long)(b.y - a.y) * (c.x - a.x);
  // Counter-clockwise triangles have a negative area, since rows grow downwards.
  const bool is_front = area < 0;
  if (area == 0 || (!is_front && (view->flags & KILN_RASTER_TWO_SIDED) == 0)) return false;
  out->a = a;
  out->b = is_front ? c : b;
  out->c = is_front ? b : c;
  return true;
}

static inline bool raster_is_small(const raster_triangle* t) {
  const int4 lo = min(t->a, min(t->b, t->c));
  const int4 hi = max(t->a, max(t->b, t->c));
  return hi.x - lo.x <= KILN_RASTER_SMALL && hi.y - lo.y <= KILN_RASTER_SMALL;
}

/// True if a depth may still win at a pixel. Reads the pixel without an atomic operation, while other
/// work-items may write it. The read is 32 bits wide, so it is never torn, and depths only decrease: a
/// stale value accepts too many, and the atomic operation that follows decides. Most triangles are
/// rejected here, since a read is cheaper than an atomic operation. With KILN_CHECK_RACES nothing is
/// read, so that a race detector can check all other accesses.
static inline bool raster_may_win(volatile global const uint* depth, uint bits) {
#ifdef KILN_CHECK_RACES
  (void)depth;
  (void)bits;
  return true;
#else
  return bits <= *depth;
#endif
}

/// Writes a triangle to a pixel, unless the pixel holds a nearer one.
static inline void raster_write_pixel(global raster_key* keys, uint pixel, float depth, uint triangle,
                                      uint pass) {
  volatile global uint* words = (volatile global uint*)(keys + pixel);
  const uint bits = as_uint(depth);
#ifdef KILN_RASTER_ATOMIC64
#ifdef __ENDIAN_LITTLE__
  volatile global const uint* high = words + 1;
#else
  volatile global const uint* high = words;
#endif
  if (raster_may_win(high, bits)) {
    atom_min((volatile global ulong*)(keys + pixel), (ulong)bits << 32 | triangle);
  }
  (void)pass;
#else
  if (pass == 0) {
    if (raster_may_win(words + 1, bits)) atomic_min(words + 1, bits);
  } else if (bits == words[1]) {
    atomic_min(words, triangle);
  }
#endif
}

/// Draws triangles of at most 32 x 32 pixels; queues larger ones as {triangle, first row, last
/// row}.
kernel void kiln_raster_draw_small(const kiln_view view, const uint first, const uint count,
                                   const uint pass, global const uint* restrict triangles,
                                   global const int4* restrict projected,
                                   global raster_key* restrict keys, global uint* restrict queue_size,
                                   global uint4* restrict queue) {
#pragma OPENCL FP_CONTRACT OFF
  const uint i = (uint)get_global_id(0);
  if (i >= count) return;
  const uint triangle = first + i;
  raster_triangle t;
  if (!raster_fetch(&view, triangle, triangles, projected, &t)) return;
  if (!raster_is_small(&t)) {
    if (pass == 0) {
      queue[atomic_inc(queue_size)] = (uint4)(triangle, (uint)t.y0, (uint)t.y1, 0u);
    }
    return;
  }
  const int2 ab = t.b.xy - t.a.xy;
  const int2 bc = t.c.xy - t.b.xy;
  const int2 ca = t.a.xy - t.c.xy;
  const int area = ab.x * -ca.y + ab.y * ca.x;
  const float reciprocal = 1.0f / (float)area;
  const float za = as_float(t.a.z);
  const float zb = as_float(t.b.z) - za;
  const float zc = as_float(t.c.z) - za;
  // Edge functions at the first pixel's centre: weights of c, a, b times the doubled area.
  const int2 centre = (int2)(t.x0, t.y0) * KILN_RASTER_UNIT + KILN_RASTER_UNIT / 2;
  const int2 from_a = centre - t.a.xy;
  const int2 from_b = centre - t.b.xy;
  const int2 from_c = centre - t.c.xy;
  int row_c = ab.x * from_a.y - ab.y * from_a.x;
  int row_a = bc.x * from_b.y - bc.y * from_b.x;
  int row_b = ca.x * from_c.y - ca.y * from_c.x;
  const int8 lane = (int8)(0, 1, 2, 3, 4, 5, 6, 7) * KILN_RASTER_UNIT;
  const int8 lane_c = lane * -ab.y;
  const int8 lane_a = lane * -bc.y;
  const int8 lane_b = lane * -ca.y;
  const int bias_c = raster_bias(ab.x, ab.y);
  const int bias_a = raster_bias(bc.x, bc.y);
  const int bias_b = raster_bias(ca.x, ca.y);
  for (int y = t.y0; y <= t.y1; ++y) {
    for (int x = t.x0; x <= t.x1; x += 8) {
      const int x_offset = (x - t.x0) * KILN_RASTER_UNIT;
      const int8 weight_c = lane_c + (row_c - x_offset * ab.y);
      const int8 weight_a = lane_a + (row_a - x_offset * bc.y);
      const int8 weight_b = lane_b + (row_b - x_offset * ca.y);
      const int8 outside = ((weight_c + bias_c) | (weight_a + bias_a) | (weight_b + bias_b)) >> 31;
      uint bits = ~mask_bits8(outside) & 0xFFu;
      const int left = t.x1 - x + 1;
      if (left < 8) bits &= (1u << left) - 1u;
      if (bits == 0) continue;
      const float8 depth =
          za + (convert_float8(weight_b) * zb + convert_float8(weight_c) * zc) * reciprocal;
      float depths[8];
      vstore8(depth, 0, depths);
      for (; bits != 0; bits &= bits - 1) {
        const uint k = mask_lowest(bits);
        const uint pixel = keys_index(view.first, view.width, (uint)x + k, (uint)y);
        raster_write_pixel(keys, pixel, depths[k], triangle, pass);
      }
    }
    row_c += ab.x * KILN_RASTER_UNIT;
    row_a += bc.x * KILN_RASTER_UNIT;
    row_b += ca.x * KILN_RASTER_UNIT;
  }
}

/// Draws the queued triangles. Each work-group draws the rows of one band, from the first to the last covered pixel of
/// each row.
kernel void kiln_raster_draw_large(const kiln_view view, const uint pass,
                                   global const uint* restrict triangles,
                                   global const int4* restrict projected,
                                   global raster_key* restrict keys,
                                   global const uint* restrict queue_size,
                                   global const uint4* restrict queue) {
#pragma OPENCL FP_CONTRACT OFF
  const uint band_rows = (view.height + KILN_RASTER_BANDS - 1) / KILN_RASTER_BANDS;
  const int first_row = (int)((uint)get_group_id(0) * band_rows);
  const int last_row = first_row + (int)band_rows - 1;
  const uint queued = queue_size[0];
  for (uint q = (uint)get_local_id(0); q < queued; q += 64u) {
    const uint4 entry = queue[q];
    const int y0 = max((int)entry.y, first_row);
    const int y1 = min((int)entry.z, last_row);
    raster_triangle t;
    if (y0 > y1 || !raster_fetch(&view, entry.x, triangles, projected, &t)) continue;
    const raster_large large = raster_large_of(t.a, t.b, t.c);
    for (int y = y0; y <= y1; ++y) {
      const raster_row row = raster_row_of(&large, y, t.x0, t.x1);
      for (long x = row.first; x <= row.last; ++x) {
        const float weight_b = (float)(row.weight_b + row.step_b * x);
        const float weight_c = (float)(row.weight_c + row.step_c * x);
        const float depth =
            large.za + (weight_b * large.zb + weight_c * large.zc) * large.reciprocal;
        const uint pixel = keys_index(view.first, view.width, (uint)x, (uint)y);
        raster_write_pixel(keys, pixel, depth, entry.x, pass);
      }
    }
  }
}
