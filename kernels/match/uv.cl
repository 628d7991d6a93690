// Matching by UVs: rasterises the high poly's triangles in UV space.
//
// Purpose: if both meshes' UVs coincide, a sample stands for the high poly's point with its UV, without a
// search (Gumbau, Gonzalez, Chover, "Fast GPU-based normal map generation for simplified models", WSCG
// 2006). The paper uses a GPU's rasteriser; here exact edge functions are used.
//
// Algorithm: integer edge functions (Pineda 1988, "A Parallel Algorithm for Polygon Rasterization") with
// the top-left rule, the same as texel.cl's. Most triangles are small, so a work-item draws one triangle
// (or a tile of a large one) and writes its samples with an atomic minimum: the lowest index wins in any
// order. A sample that is written twice also stores the highest index, by an atomic maximum. On CPUs, where
// atomics are slow and threads few, a work-item draws all triangles of a run of rows in order, eight
// samples at a time. The weights of a sample are quotients of differences of products. Two more fused
// multiply-adds make these accurate to the last bits (Kahan; Jeannerod, Louvet, Muller, "Further analysis
// of Kahan's algorithm for the accurate computation of 2 x 2 determinants", 2013).
//
// kernel                     global       local  memory traffic an item
// kiln_uv_cover              tasks        64     reads 48 B; 4 B a sample inside, atomic
// kiln_uv_cover_run          runs         1      clears its rows; 48 B a task, 8 B a sample inside
// kiln_uv_count              rows         64     reads 8 B a sample of the row, writes 32 B
// kiln_uv_match              texels       64     reads 8 B + 8 B a sample + a piece (gathered), writes 13 B a sample
// kiln_uv_match_wide           texels/8   64     the same
// kiln_uv_measure_distances  samples      64     reads 36 B + a triangle (gathered), writes 4 B
//
// Defines: KILN_UV_SINGLE=1: one sample a texel; KILN_UV_CLIPPED=1: some pieces are parts of triangles;
// KILN_UV_LARGE=1: sides of some pieces exceed floats' precision and need 64-bit integers.
//
// Strengths: no search, no sort, linear in triangles and samples. Limits: the layouts must agree, and the
// dense one must not overlap; the host checks both.

#include "lib/vector3.clh"
#include "lib/wide3.clh"
#include "match/uv_edges.clh"
#include "shared/match.h"
#include "shared/uv.h"

#ifndef KILN_UV_SINGLE
#define KILN_UV_SINGLE 0
#endif
#ifndef KILN_UV_LARGE
#define KILN_UV_LARGE 0
#endif
#ifndef KILN_UV_CLIPPED
#define KILN_UV_CLIPPED 0
#endif

/// Draws one task: writes the piece's index to the samples that it covers.
kernel void kiln_uv_cover(const kiln_uv_params params, global const kiln_uv_task* restrict tasks,
                          global const kiln_uv_piece* restrict pieces, global uint* restrict lowest,
                          global uint* restrict highest) {
  const size_t index = get_global_id(0);
  if (index >= params.task_count) return;
  const kiln_uv_task task = tasks[params.first_task + index];
  const kiln_uv_piece p = pieces[task.piece];
  const int y_begin = max(task.y, params.row_begin);
  const int y_end = min(task.y + (int)(task.size >> 16), params.row_end);
  if (y_begin >= y_end) return;
  const int width = (int)(task.size & 0xFFFFu);
  uv_edges edges = uv_edges_of(&p, params.shift, task.x, y_begin);
  size_t place = (size_t)(y_begin - params.row_begin) * params.sample_width + (size_t)task.x;
  for (int y = y_begin; y < y_end; ++y) {
    long e0 = edges.row[0], e1 = edges.row[1], e2 = edges.row[2];
    for (int x = 0; x < width; ++x) {
      if ((e0 | e1 | e2) >= 0) {
        const uint previous = atomic_min(lowest + place + x, task.piece);
        if (previous != KILN_UV_EMPTY)
          atomic_max(highest + place + x, max(previous, task.piece) + 1u);
      }
      e0 += edges.step_x[0];
      e1 += edges.step_x[1];
      e2 += edges.step_x[2];
    }
    for (int k = 0; k < 3; ++k) edges.row[k] += edges.step_y[k];
    place += params.sample_width;
  }
}

/// True if a piece's edge functions fit 32 bits, within its box and up to eight samples to the right
/// of it.
static bool uv_is_small(const kiln_uv_piece* p, const uint shift) {
  const long across =
      (long)max(max(p->x[0], p->x[1]), p->x[2]) - min(min(p->x[0], p->x[1]), p->x[2]);
  const long down = (long)max(max(p->y[0], p->y[1]), p->y[2]) - min(min(p->y[0], p->y[1]), p->y[2]);
  const long longest = max(across, down);
  return longest < (1L << 26) && ((2L * longest * longest) >> shift) + 10L * longest < (1L << 31);
}

/// Writes the index of a piece to one sample. Pieces must be written in ascending order.
static void uv_append(const uint piece, const uint count, global uint* lowest,
                      global uint* highest) {
  if (*lowest == KILN_UV_EMPTY) {
    *lowest = piece;
  } else if (count != 0u) {
    *highest = piece + 1u;
  }
}

/// Clears a run of KILN_UV_TILE rows and draws all its tasks, in the order of their pieces.
kernel void kiln_uv_cover_run(const kiln_uv_params params,
                              global const uint* restrict first_tasks,  // index of the first task, per run of rows
                              global const kiln_uv_task* restrict tasks,
                              global const kiln_uv_piece* restrict pieces,
                              global uint* restrict lowest, global uint* restrict highest) {
  const uint index = (uint)get_global_id(0);
  if (index >= params.run_count) return;
  const uint run = params.first_run + index;
  const int top = max((int)(run * KILN_UV_TILE), params.row_begin);
  const int bottom = min((int)((run + 1u) * KILN_UV_TILE), params.row_end);
  const size_t pitch = params.sample_width;
  const size_t begin = (size_t)(top - params.row_begin) * pitch;
  const size_t end = (size_t)(bottom - params.row_begin) * pitch;
  for (size_t i = begin; i < end; ++i) lowest[i] = KILN_UV_EMPTY;
  if (params.count_overlap != 0u) {
    for (size_t i = begin; i < end; ++i) highest[i] = 0u;
  }
  const int8 ramp = (int8)(0, 1, 2, 3, 4, 5, 6, 7);
  const uint last = first_tasks[run + 1u];
  for (uint t = first_tasks[run]; t < last; ++t) {
    const kiln_uv_task task = tasks[t];
    const kiln_uv_piece p = pieces[task.piece];
    const int y_begin = max(task.y, top);
    const int y_end = min(task.y + (int)(task.size >> 16), bottom);
    if (y_begin >= y_end) continue;
    const int width = (int)(task.size & 0xFFFFu);
    uv_edges edges = uv_edges_of(&p, params.shift, task.x, y_begin);
    size_t place = (size_t)(y_begin - params.row_begin) * pitch + (size_t)task.x;
    if (!uv_is_small(&p, params.shift)) {
      for (int y = y_begin; y < y_end; ++y) {
        long e0 = edges.row[0], e1 = edges.row[1], e2 = edges.row[2];
        for (int x = 0; x < width; ++x) {
          if ((e0 | e1 | e2) >= 0) {
            uv_append(task.piece, params.count_overlap, lowest + place + x, highest + place + x);
          }
          e0 += edges.step_x[0];
          e1 += edges.step_x[1];
          e2 += edges.step_x[2];
        }
        for (int k = 0; k < 3; ++k) edges.row[k] += edges.step_y[k];
        place += pitch;
      }
      continue;
    }
    const int step0 = (int)edges.step_x[0], step1 = (int)edges.step_x[1];
    const int step2 = (int)edges.step_x[2];
    int8 row0 = (int)edges.row[0] + step0 * ramp;
    int8 row1 = (int)edges.row[1] + step1 * ramp;
    int8 row2 = (int)edges.row[2] + step2 * ramp;
    for (int y = y_begin; y < y_end; ++y) {
      for (int x = 0; x < width; x += 8) {
        const int8 inside = (((row0 + step0 * x) | (row1 + step1 * x) | (row2 + step2 * x)) >= 0) &
                            (x + ramp < width);
        if (!wide_any(inside)) continue;
        global uint* low = lowest + place + x;
        global uint* high = highest + place + x;
        if (place + x + 8u > end) {  // the elements that follow belong to rows of another work-item
          int lanes[8];
          vstore8(inside, 0, lanes);
          for (int i = 0; i < width - x && i < 8; ++i) {
            if (lanes[i] != 0) uv_append(task.piece, params.count_overlap, low + i, high + i);
          }
          continue;
        }
        const uint8 current = vload8(0, low);
        const int8 is_empty = current == KILN_UV_EMPTY;
        vstore8(select(current, (uint8)(task.piece), as_uint8(inside & is_empty)), 0, low);
        if (params.count_overlap != 0u && wide_any(inside & ~is_empty)) {
          const uint8 current_highest = vload8(0, high);
          vstore8(select(current_highest, (uint8)(task.piece + 1u), as_uint8(inside & ~is_empty)),
                  0, high);
        }
      }
      row0 += (int)edges.step_y[0];
      row1 += (int)edges.step_y[1];
      row2 += (int)edges.step_y[2];
      place += pitch;
    }
  }
}

/// Counts a row's covered samples, and those that more than one piece covers.
kernel void kiln_uv_count(const kiln_uv_params params, global const uint* restrict lowest,
                          global const uint* restrict highest, global kiln_uv_row* restrict rows) {
  const size_t y = get_global_id(0);
  if (y >= (size_t)(params.row_end - params.row_begin)) return;
  const size_t first = y * params.sample_width;
  kiln_uv_row row;
  row.covered = row.overlapping = 0u;
  row.column = row.lower = row.upper = 0u;
  row.padding[0] = row.padding[1] = row.padding[2] = 0u;
  for (uint x = 0u; x < params.sample_width; ++x) {
    row.covered += lowest[first + x] != KILN_UV_EMPTY ? 1u : 0u;
    const uint upper = highest[first + x];
    if (upper == 0u) continue;
    if (row.overlapping++ != 0u) continue;
    row.column = x;
    row.lower = lowest[first + x];
    row.upper = upper - 1u;
  }
  rows[y] = row;
}

/// Row of a texel in a band from its index. Avoids integer division, which vector units lack: the float
/// product is off by at most one and is corrected.
static int uv_find_row(const int index, const int width) {
#pragma OPENCL FP_CONTRACT OFF
  int row = (int)(convert_float(index) / convert_float(width));
  const int column = index - row * width;
  row -= column < 0 ? 1 : 0;
  return row + (column >= width ? 1 : 0);
}

/// Computes the determinant a d - b c.
static float uv_compute_determinant(const int a, const int b, const int c, const int d) {
#pragma OPENCL FP_CONTRACT OFF
#if KILN_UV_LARGE
  return convert_float((long)a * d - (long)b * c);
#else
  const float product = convert_float(b) * convert_float(c);
  const float error = fma(-convert_float(b), convert_float(c), product);
  return fma(convert_float(a), convert_float(d), -product) + error;
#endif
}

/// Computes eight determinants a d - b c; inputs must be exactly representable as floats.
static float8 uv_compute_determinant8(const float8 a, const float8 b, const float8 c, const float8 d) {
#pragma OPENCL FP_CONTRACT OFF
  const float8 product = b * c;
  const float8 error = fma(-b, c, product);
  return fma(a, d, -product) + error;
}

/// Looks up the piece that covers each sample of a texel, and the sample's barycentrics in it.
/// Uncovered samples use the first piece (there is at least one) and discard the result, since
/// branch-free code is vectorised.
kernel void kiln_uv_match(const kiln_uv_params params, global const uint* restrict texel_index,
                          global const uint* restrict texel_first,
                          global const uint* restrict sample_slot,
                          global const uint* restrict lowest,
                          global const kiln_uv_piece* restrict pieces,
                          global const kiln_uv_clip* restrict clips,
                          global uint* restrict hit_triangle,
                          global float* restrict hit_barycentric,
                          global float* restrict hit_distance, global uchar* restrict hit_status) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t texel = get_global_id(0);
  if (texel >= params.texel_count) return;
  const int texel_row = uv_find_row((int)texel_index[texel], (int)params.width);
  const int texel_column = (int)texel_index[texel] - texel_row * (int)params.width;
  const int half_sample = 1 << (params.shift - 1u);
#if KILN_UV_SINGLE
  (void)texel_first;
  (void)sample_slot;
  const size_t s = texel;
  {
    const int x = texel_column;
    const int y = texel_row;
#else
  const int n = (int)params.samples;
  const uint end = texel_first[texel + 1u];
  for (uint s = texel_first[texel]; s < end; ++s) {
    const int slot_row = uv_find_row((int)sample_slot[s], n);
    const int x = texel_column * n + ((int)sample_slot[s] - slot_row * n);
    const int y = texel_row * n + slot_row;
#endif
    const uint id = lowest[(size_t)(y * (int)params.sample_width + x)];
    const bool found = id != KILN_UV_EMPTY;
    global const kiln_uv_piece* p = pieces + (found ? id : 0u);
    const int x0 = p->x[0], y0 = p->y[0];
    const int px = ((x << params.shift) + half_sample) - x0;
    const int py = (((params.row_begin + y) << params.shift) + half_sample) - y0;
    const int ax = p->x[1] - x0, ay = p->y[1] - y0;
    const int bx = p->x[2] - x0, by = p->y[2] - y0;
    // Numerators and denominator have the same sign, for either winding.
    const float area = uv_compute_determinant(ax, ay, bx, by);
    float u = min(max(uv_compute_determinant(px, py, bx, by) / area, 0.0f), 1.0f);
    float v = min(max(uv_compute_determinant(ax, ay, px, py) / area, 0.0f), 1.0f - u);
#if !KILN_UV_CLIPPED
    (void)clips;
#else
    if (p->clip != 0u) {
      global const kiln_uv_clip* c = clips + (p->clip - 1u);
      const float w = 1.0f - u - v;
      const float part_u = u, part_v = v;
      u = c->weight1[0] * w + c->weight1[1] * part_u + c->weight1[2] * part_v;
      v = c->weight2[0] * w + c->weight2[1] * part_u + c->weight2[2] * part_v;
      u = min(max(u, 0.0f), 1.0f);
      v = min(max(v, 0.0f), 1.0f - u);
    }
#endif
    hit_triangle[s] = found ? p->triangle : KILN_NO_TRIANGLE;
    hit_barycentric[s] = found ? u : 0.0f;
    hit_barycentric[s + params.hit_capacity] = found ? v : 0.0f;
    hit_distance[s] = 0.0f;
    hit_status[s] = found ? KILN_STATUS_UV : KILN_STATUS_MISS;
  }
}

/// kiln_uv_match for CPUs and one sample per texel: eight texels per work-item, if no piece is clipped or
/// large.
kernel void kiln_uv_match_wide(const kiln_uv_params params, global const uint* restrict texel_index,
                               global const uint* restrict lowest,
                               global const kiln_uv_piece* restrict pieces,
                               global uint* restrict hit_triangle,
                               global float* restrict hit_barycentric,
                               global float* restrict hit_distance,
                               global uchar* restrict hit_status) {
#pragma OPENCL FP_CONTRACT OFF
  const uint first = (uint)get_global_id(0) * 8u;
  if (first >= params.texel_count) return;
  const bool is_full_group = first + 8u <= params.texel_count;
  const uint8 lanes = min(first + (uint8)(0u, 1u, 2u, 3u, 4u, 5u, 6u, 7u), params.texel_count - 1u);
  const int8 index = as_int8(is_full_group ? vload8(0, texel_index + first)
                                           : wide_gather_uint(texel_index, lanes));
  const int width = (int)params.width;
  int8 y = convert_int8(convert_float8(index) / (float8)(convert_float(width)));
  int8 x = index - y * width;
  const int8 is_left_of_map = x < 0;
  const int8 is_right_of_map = x >= width;
  y += is_left_of_map - is_right_of_map;
  x += (is_right_of_map - is_left_of_map) * width;

  // With one sample per texel, the sample's index is that of its texel.
  const uint8 id = wide_gather_uint(lowest, as_uint8(index));
  const int8 found = id != KILN_UV_EMPTY;
  const uint8 piece = select((uint8)(0u), id, as_uint8(found)) * 8u;
  const wide_uint4 head = wide_gather4((global const uint*)pieces, piece);
  const wide_uint4 tail = wide_gather4((global const uint*)pieces, piece + 4u);
  const int8 x0 = as_int8(head.x), y0 = as_int8(head.w);
  const int half_sample = 1 << (params.shift - 1u);
  const float8 px = convert_float8(((x << (int8)(int)params.shift) + half_sample) - x0);
  const float8 py =
      convert_float8((((params.row_begin + y) << (int8)(int)params.shift) + half_sample) - y0);
  const float8 ax = convert_float8(as_int8(head.y) - x0), ay = convert_float8(as_int8(tail.x) - y0);
  const float8 bx = convert_float8(as_int8(head.z) - x0), by = convert_float8(as_int8(tail.y) - y0);
  const float8 area = uv_compute_determinant8(ax, ay, bx, by);
  const float8 found_u = min(max(uv_compute_determinant8(px, py, bx, by) / area, 0.0f), 1.0f);
  const float8 found_v = min(max(uv_compute_determinant8(ax, ay, px, py) / area, 0.0f), 1.0f - found_u);
  const uint8 triangle = select((uint8)(KILN_NO_TRIANGLE), tail.z, as_uint8(found));
  const float8 u = select((float8)(0.0f), found_u, found);
  const float8 v = select((float8)(0.0f), found_v, found);
  const uchar8 status =
      convert_uchar8(select((uint8)(KILN_STATUS_MISS), (uint8)(KILN_STATUS_UV), as_uint8(found)));
  global float* out_u = hit_barycentric + first;
  global float* out_v = out_u + params.hit_capacity;
  if (is_full_group) {
    vstore8(triangle, 0, hit_triangle + first);
    vstore8(u, 0, out_u);
    vstore8(v, 0, out_v);
    vstore8((float8)(0.0f), 0, hit_distance + first);
    vstore8(status, 0, hit_status + first);
    return;
  }
  uint own_triangle[8];
  float own_u[8], own_v[8];
  uchar own_status[8];
  vstore8(triangle, 0, own_triangle);
  vstore8(u, 0, own_u);
  vstore8(v, 0, own_v);
  vstore8(status, 0, own_status);
  for (uint i = 0u; i < params.texel_count - first; ++i) {
    hit_triangle[first + i] = own_triangle[i];
    out_u[i] = own_u[i];
    out_v[i] = own_v[i];
    hit_distance[first + i] = 0.0f;
    hit_status[first + i] = own_status[i];
  }
}

/// Computes the distance from each sample to its point; negative if the point lies behind it, against its
/// direction.
kernel void kiln_uv_measure_distances(const kiln_uv_params params, global const float* restrict points,
                                      global const uint* restrict triangles,
                                      global const float* restrict positions,
                                      global const uint* restrict hit_triangle,
                                      global const float* restrict hit_barycentric,
                                      global float* restrict hit_distance) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.sample_count) return;
  const uint triangle = hit_triangle[i];
  if (triangle == KILN_NO_TRIANGLE) return;
  const size_t plane = params.band_capacity;
  const uint3 corner = vload3(triangle, triangles);
  const float u = hit_barycentric[i];
  const float v = hit_barycentric[i + params.hit_capacity];
  const float w = 1.0f - u - v;
  const float3 found = vload3(corner.x, positions) * w + vload3(corner.y, positions) * u +
                       vload3(corner.z, positions) * v;
  const float3 to = found - (float3)(points[i], points[i + plane], points[i + 2u * plane]);
  const float3 along =
      (float3)(points[i + 3u * plane], points[i + 4u * plane], points[i + 5u * plane]);
  const float distance = sqrt(dot3(to, to));
  hit_distance[i] = dot3(to, along) < 0.0f ? -distance : distance;
}
