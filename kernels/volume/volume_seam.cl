// Seams of a volume's map: charts that meet at an edge of the low poly hold the same normals along it.
//
// Algorithm: each chart is filled separately (volume_map.cl), so the two sides of an edge differ slightly.
// Both sides are replaced by one common curve of normals along the edge; the change fades out within a cell
// of the volume. Barry and Wood ("Direct Extraction of Normal Mapped Meshes from Volume Data", section 5)
// name such blending as future work.
//   1. At a corner: the mean of all charts that meet there.
//   2. At the nodes of the side with the fewest texels: the mean of the sides, corrected near the corners so
//      that it ends in their means. Other sides interpolate between the nodes, so that all read the same
//      values.
//   3. Differences between the curve and a chart's own texels are spread by push-pull, as for unknown
//      texels, but only by levels whose texels are at most two cells wide: farther from the seam the chart's
//      texels hold data of fine vertices, which must not change.
// Creases are preserved: the weight between two sides is 1 up to 30 degrees between their normals, and falls
// to 0 at 50 degrees.
//
// A side's texels lie in a row from corner to corner, the diagonal of a single triangle's square included.
// Bilinear filtering there also reads texels beyond the triangle, which are mirrored at the diagonal.
//
// | kernel                           | items           | local | traffic an item                              |
// |        ------------------------- | --------------- | ----- | -------------------------------------------- |
// | kiln_volume_seam_average_corners | 4 x charts      | 64    | 16 B a chart at the corner (gathered)        |
// | kiln_volume_seam_average_sides   | 4 x charts      | 64    | 16 B a texel and side read, 16 B written     |
// | kiln_volume_seam_gather          | rows of level 1 | 64    | sides' texels read, 16 B a texel written     |
// | kiln_volume_seam_push            | rows of a level | 64    | 4 x 16 B a texel read, 16 B written          |
// | kiln_volume_seam_pull            | rows of a level | 64    | 4 x 16 B an unknown texel read (cached)      |
// | kiln_volume_seam_finish          | rows            | 64    | 16 B a texel read and written                |
// | kiln_volume_seam_mirror          | charts          | 64    | a diagonal's texels; nothing for quads       |
//
// Corners and sides are items 4 chart + corner: the side starts at that corner. Coarser levels of the
// charts' pyramids are reused for differences instead of normals.
// Strengths: no atomics, and sums have a fixed order. Limits: work at a corner grows with the square of the
// charts that meet there.
#include "lib/chart.clh"
#include "lib/vector3.clh"
#include "shared/volume.h"

// The weight of another chart's side falls from 1 to 0 as the angle between the two sides' normals grows from the first
// to the second of these angles; stored as cosines.
#define SEAM_COS_FULL_WEIGHT 0.8660254f
#define SEAM_COS_NO_WEIGHT 0.6427876f
#define SEAM_NONE 0xFFFFFFFFu

typedef struct seam_side {
  int x, y;    // Texel of the side's first corner
  int dx, dy;  // Step to the next texel
  int steps;
  int reversed;  // 1: runs from the vertex with the higher index to the one with the lower index
} seam_side;

static seam_side seam_find_side(global const kiln_volume_chart* chart, uint k) {
  const uint next = k + 1u == chart->corners ? 0u : k + 1u;
  seam_side side;
  side.x = (int)chart->texel[k][0];
  side.y = (int)chart->texel[k][1];
  const int step_columns = (int)chart->texel[next][0] - side.x;
  const int step_rows = (int)chart->texel[next][1] - side.y;
  side.dx = (step_columns > 0) - (step_columns < 0);
  side.dy = (step_rows > 0) - (step_rows < 0);
  side.steps = max(abs(step_columns), abs(step_rows));
  side.reversed = chart->corner[k] > chart->corner[next] ? 1 : 0;
  return side;
}

/// Computes the weight of a side by the angle between its normal and another side's normal.
static float seam_compute_weight(float3 a, float3 b) {
#pragma OPENCL FP_CONTRACT OFF
  return clamp((dot3(a, b) - SEAM_COS_NO_WEIGHT) / (SEAM_COS_FULL_WEIGHT - SEAM_COS_NO_WEIGHT), 0.0f, 1.0f);
}

/// Computes the share of a level's differences that is added to the finer level: 1 if the level's
/// texels are at most as wide as the reach, falling to 0 at twice the reach.
static float seam_compute_fade(float reach, uint level) {
#pragma OPENCL FP_CONTRACT OFF
  return clamp(2.0f * reach / (float)(1u << level) - 1.0f, 0.0f, 1.0f);
}

/// Returns a side's normal at node j of m, counted from the vertex with the lower index.
static float3 seam_interpolate_normal(global const kiln_volume_chart* charts, global const float4* texels,
                                      uint member, int j, int m) {
#pragma OPENCL FP_CONTRACT OFF
  global const kiln_volume_chart* chart = charts + (member >> 2);
  const seam_side side = seam_find_side(chart, member & 3u);
  const ulong scaled_index = (ulong)(side.reversed != 0 ? m - j : j) * (ulong)side.steps;
  const int first = min((int)(scaled_index / (ulong)m), side.steps - 1);
  const float share = (float)(scaled_index - (ulong)first * (ulong)m) / (float)m;
  global const float4* at = texels + chart->first_texel;
  const int width = (int)chart->size[0];
  const float3 a = at[(side.y + first * side.dy) * width + side.x + first * side.dx].xyz;
  const float3 b =
      at[(side.y + (first + 1) * side.dy) * width + side.x + (first + 1) * side.dx].xyz;
  return a * (1.0f - share) + b * share;
}

/// Averages the normals of all sides at a node, weighted by their similarity to the side `self`.
static float3 seam_average_normals(global const kiln_volume_chart* charts, global const float4* texels,
                                   global const uint* members, uint begin, uint end, uint self, int j, int m) {
#pragma OPENCL FP_CONTRACT OFF
  const float3 own_normal = map_normalize(seam_interpolate_normal(charts, texels, self, j, m), (float3)(0.0f, 0.0f, 1.0f));
  float3 sum = (float3)(0.0f);
  for (uint i = begin; i < end; ++i) {
    const float3 value = map_normalize(seam_interpolate_normal(charts, texels, members[i], j, m), own_normal);
    sum += value * seam_compute_weight(own_normal, value);
  }
  return map_normalize(sum, own_normal);
}

/// Computes the mean of the charts that meet at each corner. agreed: receives the means. begins, members:
/// corners by vertex of the low poly.
kernel void kiln_volume_seam_average_corners(const kiln_volume_level params,
                                             global const kiln_volume_chart* restrict charts,
                                             global const uint* restrict begins,
                                             global const uint* restrict members,
                                             global const float4* restrict texels,
                                             global float4* restrict agreed) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= 4u * params.charts) return;
  global const kiln_volume_chart* chart = charts + (item >> 2);
  const uint k = item & 3u;
  if (k >= chart->corners) return;
  const float3 own_normal = texels[chart->first_texel + (uint)chart->texel[k][1] * chart->size[0] +
                            (uint)chart->texel[k][0]]
                         .xyz;
  float3 sum = (float3)(0.0f);
  const uint vertex = chart->corner[k];
  for (uint i = begins[vertex]; i < begins[vertex + 1u]; ++i) {
    global const kiln_volume_chart* other = charts + (members[i] >> 2);
    global const float* at = other->texel[members[i] & 3u];
    const float3 value =
        texels[other->first_texel + (uint)at[1] * other->size[0] + (uint)at[0]].xyz;
    sum += value * seam_compute_weight(own_normal, value);
  }
  agreed[item] = (float4)(map_normalize(sum, own_normal), 1.0f);
}

/// Computes the common curve along each side. ring: receives the new values of the texels on
/// each chart's sides. edges: index of the edge per side, SEAM_NONE if no other chart meets it.
/// begins, members: sides by edge. agreed: means at the corners.
kernel void kiln_volume_seam_average_sides(
    const kiln_volume_level params, global const kiln_volume_chart* restrict charts,
    global const uint* restrict edges, global const uint* restrict begins,
    global const uint* restrict members, global const float4* restrict agreed,
    global const float4* restrict texels, global float4* restrict ring) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= 4u * params.charts || edges[item] == SEAM_NONE) return;
  const uint begin = begins[edges[item]];
  const uint end = begins[edges[item] + 1u];
  global const kiln_volume_chart* chart = charts + (item >> 2);
  const uint k = item & 3u;
  global float4* out = ring + chart->first_ring;
  for (uint i = 0u; i < k; ++i) out += seam_find_side(chart, i).steps + 1;
  const seam_side side = seam_find_side(chart, k);
  int m = side.steps;
  for (uint i = begin; i < end; ++i) {
    m = min(m, seam_find_side(charts + (members[i] >> 2), members[i] & 3u).steps);
  }
  const uint next = k + 1u == chart->corners ? 0u : k + 1u;
  const float3 first = agreed[(item & ~3u) + (side.reversed != 0 ? next : k)].xyz;
  const float3 last = agreed[(item & ~3u) + (side.reversed != 0 ? k : next)].xyz;
  const float3 first_correction = first - seam_average_normals(charts, texels, members, begin, end, item, 0, m);
  const float3 last_correction = last - seam_average_normals(charts, texels, members, begin, end, item, m, m);
  const float reach = min(max(params.reach, 1.0f), (float)m);
  float3 a = first;
  float3 b = first;
  int last_node = 0;  // a and b are the values at nodes last_node - 1 and last_node
  for (int i = 0; i <= side.steps; ++i) {
    const ulong scaled_index = (ulong)i * (ulong)m;
    const int node = min((int)(scaled_index / (ulong)side.steps) + 1, m);
    while (last_node < node) {
      a = b;
      ++last_node;
      const float3 mean = seam_average_normals(charts, texels, members, begin, end, item, last_node, m);
      const float from_first = max(1.0f - (float)last_node / reach, 0.0f);
      const float from_last = max(1.0f - (float)(m - last_node) / reach, 0.0f);
      b = last_node == m ? last
                       : map_normalize(mean + (first_correction * from_first + last_correction * from_last), mean);
    }
    const float share = (float)(scaled_index - (ulong)(node - 1) * (ulong)side.steps) / (float)side.steps;
    const float3 value = map_normalize(a * (1.0f - share) + b * share, a);
    out[side.reversed != 0 ? side.steps - i : i] = (float4)(value, 1.0f);
  }
}

/// The new value of a texel that lies on a side of its chart; w is 0 for other texels.
static float4 seam_read_texel(global const kiln_volume_chart* chart, global const float4* ring, int x,
                              int y) {
  // Most texels of a quad lie in neither a row nor a column of its corners, so they lie on no side.
  global const float* first = chart->texel[0];
  global const float* across = chart->texel[2];
  if (chart->corners == 4u && x != (int)first[0] && x != (int)across[0] && y != (int)first[1] &&
      y != (int)across[1]) {
    return (float4)(0.0f);
  }
  global const float4* at = ring + chart->first_ring;
  for (uint k = 0u; k < chart->corners; ++k) {
    const seam_side side = seam_find_side(chart, k);
    const int i = side.dx != 0 ? (x - side.x) * side.dx : (y - side.y) * side.dy;
    if (i >= 0 && i <= side.steps && x == side.x + i * side.dx && y == side.y + i * side.dy) {
      return at[i];
    }
    at += side.steps + 1;
  }
  return (float4)(0.0f);
}

/// Writes the differences of the texels on sides to level 1. row_charts, first_rows,
/// first_texels: as in volume_map.cl.
kernel void kiln_volume_seam_gather(const kiln_volume_level params,
                                    global const kiln_volume_chart* restrict charts,
                                    global const uint* restrict row_charts,
                                    global const uint* restrict first_rows,
                                    global const uint* restrict first_texels,
                                    global const float4* restrict ring, global float4* texels) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= params.rows) return;
  const uint index = row_charts[item];
  global const kiln_volume_chart* chart = charts + index;
  const int row = (int)(item - first_rows[index]);
  const int width = map_side(chart->size[0], 1u);
  const int fine_width = (int)chart->size[0];
  global const float4* fine = texels + chart->first_texel;
  global float4* out = map_level(texels, first_texels, params.charts, 1u, index) + row * width;
  for (int x = 0; x < width; ++x) {
    float4 sum = (float4)(0.0f);
    for (int k = 0; k < 4; ++k) {
      const int fx = 2 * x + (k & 1);
      const int fy = 2 * row + (k >> 1);
      if (fx >= fine_width || fy >= (int)chart->size[1]) continue;
      const float4 value = seam_read_texel(chart, ring, fx, fy);
      if (value.w != 0.0f) sum += (float4)(value.xyz - fine[fy * fine_width + fx].xyz, 1.0f);
    }
    out[x] = sum.w == 0.0f ? sum : sum / sum.w;
  }
}

/// Averages the known texels among the 2 x 2 of the finer level under each texel.
kernel void kiln_volume_seam_push(const kiln_volume_level params,
                                  global const kiln_volume_chart* restrict charts,
                                  global const uint* restrict row_charts,
                                  global const uint* restrict first_rows,
                                  global const uint* restrict first_texels, global float4* texels) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= params.rows) return;
  const uint chart = row_charts[item];
  const int row = (int)(item - first_rows[chart]);
  const uint level = params.level;
  const int width = map_side(charts[chart].size[0], level);
  const int fine_width = map_side(charts[chart].size[0], level - 1u);
  const int fine_height = map_side(charts[chart].size[1], level - 1u);
  global const float4* fine = map_level(texels, first_texels, params.charts, level - 1u, chart);
  global float4* out = map_level(texels, first_texels, params.charts, level, chart) + row * width;
  for (int x = 0; x < width; ++x) {
    float4 sum = (float4)(0.0f);
    for (int k = 0; k < 4; ++k) {
      const int fx = 2 * x + (k & 1);
      const int fy = 2 * row + (k >> 1);
      if (fx < fine_width && fy < fine_height) sum += fine[fy * fine_width + fx];
    }
    out[x] = sum.w == 0.0f ? sum : sum / sum.w;
  }
}

/// Fills unknown texels from the coarser level, all of whose texels are known.
kernel void kiln_volume_seam_pull(const kiln_volume_level params,
                                  global const kiln_volume_chart* restrict charts,
                                  global const uint* restrict row_charts,
                                  global const uint* restrict first_rows,
                                  global const uint* restrict first_texels, global float4* texels) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= params.rows) return;
  const uint chart = row_charts[item];
  const int row = (int)(item - first_rows[chart]);
  const uint level = params.level;
  const int width = map_side(charts[chart].size[0], level);
  const int coarse_width = map_side(charts[chart].size[0], level + 1u);
  const int coarse_height = map_side(charts[chart].size[1], level + 1u);
  global const float4* coarse = map_level(texels, first_texels, params.charts, level + 1u, chart);
  global float4* out = map_level(texels, first_texels, params.charts, level, chart) + row * width;
  const float share = 0.0625f * seam_compute_fade(params.reach, level + 1u);
  for (int x = 0; x < width; ++x) {
    if (out[x].w != 0.0f) continue;
    out[x] = map_coarser(coarse, coarse_width, coarse_height, x, row) * share;
  }
}

/// Writes level 0, the map itself: texels on a side of a chart get the common curve's normals, other texels
/// the interpolated differences.
kernel void kiln_volume_seam_finish(const kiln_volume_level params,
                                    global const kiln_volume_chart* restrict charts,
                                    global const uint* restrict row_charts,
                                    global const uint* restrict first_rows,
                                    global const uint* restrict first_texels,
                                    global const float4* restrict ring, global float4* texels) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= params.rows) return;
  const uint index = row_charts[item];
  global const kiln_volume_chart* chart = charts + index;
  const int row = (int)(item - first_rows[index]);
  const int width = (int)chart->size[0];
  const int coarse_width = map_side(chart->size[0], 1u);
  const int coarse_height = map_side(chart->size[1], 1u);
  global const float4* coarse = map_level(texels, first_texels, params.charts, 1u, index);
  global float4* out = texels + chart->first_texel + row * width;
  const float share = 0.0625f * seam_compute_fade(params.reach, 1u);
  for (int x = 0; x < width; ++x) {
    const float4 value = seam_read_texel(chart, ring, x, row);
    if (value.w != 0.0f) {
      out[x] = value;
      continue;
    }
    const float4 correction = map_coarser(coarse, coarse_width, coarse_height, x, row) * share;
    out[x] = (float4)(map_normalize(out[x].xyz + correction.xyz, out[x].xyz), 1.0f);
  }
}

/// Mirrors texels at the diagonal of single triangles, so that bilinear filtering along the diagonal
/// returns the diagonal's texels.
kernel void kiln_volume_seam_mirror(const kiln_volume_level params,
                                    global const kiln_volume_chart* restrict charts,
                                    global float4* restrict texels) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= params.charts || charts[item].corners != 3u) return;
  global const kiln_volume_chart* chart = charts + item;
  const seam_side side = seam_find_side(chart, 2u);
  const int width = (int)chart->size[0];
  global float4* at = texels + chart->first_texel;
  // Corner 1 has either the column of corner 2, where the side starts, or its row.
  const bool same_column = (int)chart->texel[1][0] == side.x;
  for (int i = 0; i < side.steps; ++i) {
    const int x = side.x + i * side.dx;
    const int y = side.y + i * side.dy;
    const int inner = same_column ? (y + side.dy) * width + x : y * width + x + side.dx;
    const int outer = same_column ? y * width + x + side.dx : (y + side.dy) * width + x;
    const float3 ends = at[y * width + x].xyz + at[(y + side.dy) * width + x + side.dx].xyz;
    at[outer] = (float4)(map_normalize(ends - at[inner].xyz, at[inner].xyz), 1.0f);
  }
}
