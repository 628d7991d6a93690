// Matching by UVs: the dense mesh's triangles, drawn where they lie in the texture.
//
// Purpose: where both meshes' UVs lie over each other, the point of the dense mesh that a sample stands
// for is the one with the sample's UV; nothing is searched (Gumbau, Gonzalez, Chover, "Fast GPU-based
// normal map generation for simplified models", WSCG 2006). They let a GPU's rasteriser draw the
// triangles; here edge functions do, exactly.
//
// Algorithm: integer edge functions (Pineda 1988, "A Parallel Algorithm for Polygon Rasterization") with
// the top-left rule, the same as texel.cl's. Triangles are small and many, so a work-item takes one (or a
// tile of a large one) and writes its samples with an atomic minimum: the lowest index wins whatever the
// order. A sample that is written twice also gets the highest index, by an atomic maximum. The weights of
// a sample are ratios of integers, each rounded once, and their quotient once more.
//
// kernel            global       local  memory traffic an item
// kiln_uv_cover     tasks        64     reads 48 B; 4 B a sample inside, atomic
// kiln_uv_count     rows         64     reads 8 B a sample of the row, writes 32 B
// kiln_uv_match     texels       64     reads 8 B + 8 B a sample + a piece (gathered), writes 13 B a sample
// kiln_uv_distance  samples      64     reads 36 B + a triangle (gathered), writes 4 B
//
// Defines: KILN_UV_SINGLE=1: one sample a texel; KILN_UV_CLIPPED=1: some pieces are parts of triangles.
//
// Strengths: no search, no sort, linear in triangles and samples. Limits: the layouts must agree, and the
// dense one must not overlap; the host checks both.

#include "lib/vector3.clh"
#include "shared/match.h"
#include "shared/uv.h"

#ifndef KILN_UV_SINGLE
#define KILN_UV_SINGLE 0
#endif
#ifndef KILN_UV_CLIPPED
#define KILN_UV_CLIPPED 0
#endif

/// Writes a task's samples.
kernel void kiln_uv_cover(const kiln_uv_params params,
                          global const kiln_uv_task* restrict tasks,
                          global const kiln_uv_piece* restrict pieces,
                          global uint* restrict lowest,
                          global uint* restrict highest) {
  const size_t index = get_global_id(0);
  if (index >= params.task_count) return;
  const kiln_uv_task task = tasks[params.first_task + index];
  const kiln_uv_piece p = pieces[task.piece];
  const int y_begin = max(task.y, params.row_begin);
  const int y_end = min(task.y + (int)(task.size >> 16), params.row_end);
  if (y_begin >= y_end) return;
  const int width = (int)(task.size & 0xFFFFu);

  // E_k = a_k x + b_k y + c_k in fixed point, above 0 inside, without the low bits that all samples have
  // alike; open edges lose one unit, so that 0 counts as inside on closed edges only.
  const long area = (long)(p.x[1] - p.x[0]) * (long)(p.y[2] - p.y[0]) -
                    (long)(p.y[1] - p.y[0]) * (long)(p.x[2] - p.x[0]);
  const int sign = area < 0 ? -1 : 1;
  const long half_sample = 1L << (params.shift - 1u);
  long row[3], step_x[3], step_y[3];
  for (int k = 0; k < 3; ++k) {
    const int from = k == 2 ? 0 : k + 1;
    const int to = k == 0 ? 2 : k - 1;
    const int dx = sign * (p.x[to] - p.x[from]);
    const int dy = sign * (p.y[to] - p.y[from]);
    const long open = dy < 0 || (dy == 0 && dx > 0) ? 0 : 1;
    const long c = (long)dx * (half_sample - p.y[from]) - (long)dy * (half_sample - p.x[from]);
    step_x[k] = -dy;
    step_y[k] = dx;
    row[k] = ((c - open) >> params.shift) + step_x[k] * task.x + step_y[k] * y_begin;
  }
  size_t place = (size_t)(y_begin - params.row_begin) * params.sample_width + (size_t)task.x;
  for (int y = y_begin; y < y_end; ++y) {
    long e0 = row[0], e1 = row[1], e2 = row[2];
    for (int x = 0; x < width; ++x) {
      if ((e0 | e1 | e2) >= 0) {
        const uint before = atomic_min(lowest + place + x, task.piece);
        if (before != KILN_UV_EMPTY) atomic_max(highest + place + x, max(before, task.piece) + 1u);
      }
      e0 += step_x[0];
      e1 += step_x[1];
      e2 += step_x[2];
    }
    row[0] += step_y[0];
    row[1] += step_y[1];
    row[2] += step_y[2];
    place += params.sample_width;
  }
}

/// Counts a row's samples, and those covered by more than one piece.
kernel void kiln_uv_count(const kiln_uv_params params,
                          global const uint* restrict lowest,
                          global const uint* restrict highest,
                          global kiln_uv_row* restrict rows) {
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

/// The row of a texel of a band, of which it is the index. Without integer division, which no vector unit
/// has: the product is off by one at most.
static int uv_row(const int index, const int width) {
#pragma OPENCL FP_CONTRACT OFF
  int row = (int)(convert_float(index) / convert_float(width));
  const int rest = index - row * width;
  row -= rest < 0 ? 1 : 0;
  return row + (rest >= width ? 1 : 0);
}

/// Looks up who covers each sample of a texel, and where in the triangle the sample lies. There is at least
/// one piece; where none covers a sample, the first is computed with and the result thrown away, since
/// code without branches becomes vectors.
kernel void kiln_uv_match(const kiln_uv_params params,
                          global const uint* restrict texel_index,
                          global const uint* restrict texel_first,
                          global const uint* restrict sample_slot,
                          global const uint* restrict lowest,
                          global const kiln_uv_piece* restrict pieces,
                          global const kiln_uv_clip* restrict clips,
                          global uint* restrict hit_triangle,
                          global float* restrict hit_barycentric,
                          global float* restrict hit_distance,
                          global uchar* restrict hit_status) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t texel = get_global_id(0);
  if (texel >= params.texel_count) return;
  const int texel_row = uv_row((int)texel_index[texel], (int)params.width);
  const int texel_column = (int)texel_index[texel] - texel_row * (int)params.width;
  const long half_sample = 1L << (params.shift - 1u);
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
    const int slot_row = uv_row((int)sample_slot[s], n);
    const int x = texel_column * n + ((int)sample_slot[s] - slot_row * n);
    const int y = texel_row * n + slot_row;
#endif
    const uint id = lowest[(size_t)(y * (int)params.sample_width + x)];
    const bool found = id != KILN_UV_EMPTY;
    global const kiln_uv_piece* p = pieces + (found ? id : 0u);
    const long x0 = p->x[0], y0 = p->y[0];
    const long ax = p->x[1] - x0, ay = p->y[1] - y0;
    const long bx = p->x[2] - x0, by = p->y[2] - y0;
    const long px = (((long)x << params.shift) + half_sample) - x0;
    const long py = (((long)(params.row_begin + y) << params.shift) + half_sample) - y0;
    // Numerator and denominator have the same sign, whichever way round the triangle runs.
    const float area = convert_float(ax * by - ay * bx);
    float u = min(convert_float(px * by - py * bx) / area, 1.0f);
    float v = min(convert_float(ax * py - ay * px) / area, 1.0f - u);
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

/// The distance from each sample to its point: negative where that lies behind it, against its direction.
kernel void kiln_uv_distance(const kiln_uv_params params,
                             global const float* restrict points,
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
