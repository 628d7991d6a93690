// Normal maps of charts from fine vertices: splatting, filling, encoding in tangent space.
//
// Algorithm: Barry and Wood, "Direct Extraction of Normal Mapped Meshes from Volume Data". The fine
// vertices of the clusters that a polygon spans are projected onto it. Their normals are summed in the
// texels that they fall into. Other texels are filled by pull-push within the chart (Grossman and Dally
// 1998, "Point Sample Rendering", section 3.3; Gortler et al. 1996, "The Lumigraph", section 3.4): a
// coarser texel holds the mean of the known ones among 2 x 2. An unknown texel holds the bilinear
// interpolation (9, 3, 3, 1)/16 of the coarser level. Texels are float4: a normal, and 1 where known.
//
// | kernel                 | items           | local | traffic an item                           |
// | ------------------------- | --------------- | ----- | ----------------------------------------- |
// | kiln_volume_map_splat  | charts          | 64    | 28 B a fine vertex read (gathered), 16 B a |
// |                           |                 |       | texel written                             |
// | kiln_volume_map_push   | rows of a level | 64    | 4 x 16 B a texel read, 16 B written       |
// | kiln_volume_map_pull   | rows of a level | 64    | 4 x 16 B an unknown texel read (cached)   |
// | kiln_volume_map_encode | rows            | 64    | 16 B a texel read and written             |
//
// Strengths: charts never mix; no atomics, so sums have a fixed order. Limits: a chart is splatted by
// one item, so few large charts leave a GPU idle.
#include "lib/chart.clh"
#include "lib/vector3.clh"
#include "shared/detail.h"
#include "shared/volume.h"

/// Weights of a triangle's three corners from those of its 2nd and 3rd.
static float3 map_complete_weights(float second, float third) {
#pragma OPENCL FP_CONTRACT OFF
  return (float3)(1.0f - second - third, second, third);
}

static float map_find_min(float3 weights) { return min(weights.x, min(weights.y, weights.z)); }

/// Finds the chart's triangle that contains a point, or is nearest to it, and the point's weights in this triangle. A
/// chart of two triangles is a rectangle, whose diagonal they share. If the point's projection onto the plane of the
/// first triangle lies beyond the diagonal, the point is assigned to the second triangle, provided that its projection
/// onto the plane of the second triangle lies in the second half of the rectangle. Above a ridge between the two
/// triangles, both projections may lie beyond the diagonal; the point is then assigned to the diagonal.
static uint map_project(global const kiln_volume_chart* chart, float3 point, float3* weights) {
#pragma OPENCL FP_CONTRACT OFF
  uint best = 0u;
  bool best_in_own_half = false;
  for (uint k = 0u; k < chart->triangles; ++k) {
    global const float* second = chart->project[k][0];
    global const float* third = chart->project[k][1];
    const float3 at = map_complete_weights(dot3(vload3(0, second), point) + second[3],
                                           dot3(vload3(0, third), point) + third[3]);
    const bool in_own_half = chart->triangles == 1u || (k == 0u ? at.y : at.z) >= 0.0f;
    if (k == 0u || (in_own_half && !best_in_own_half) || (in_own_half == best_in_own_half && map_find_min(at) > map_find_min(*weights))) {
      *weights = at;
      best = k;
      best_in_own_half = in_own_half;
    }
  }
  if (best_in_own_half) return best;
  const float diagonal_weight = best == 0u ? weights->y : weights->z;
  weights->x += diagonal_weight * 0.5f;
  if (best == 0u) {
    weights->y = 0.0f;
    weights->z += diagonal_weight * 0.5f;
  } else {
    weights->z = 0.0f;
    weights->y += diagonal_weight * 0.5f;
  }
  return best;
}

/// leaves: fine vertices grouped by vertex of the low poly, starting at leaf_begins[v]. splatted:
/// number of known texels.
kernel void kiln_volume_map_splat(const kiln_volume_level params,
                                  global const kiln_volume_chart* restrict charts,
                                  global const uint* restrict leaf_begins,
                                  global const uint* restrict leaves,
                                  global const kiln_volume_vertex* restrict fine,
                                  global const float* restrict low_normals,
                                  global float4* restrict texels, global uint* restrict splatted) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= params.charts) return;
  global const kiln_volume_chart* chart = charts + item;
  const int width = (int)chart->size[0];
  const int height = (int)chart->size[1];
  global float4* out = texels + chart->first_texel;
  for (int i = 0; i < width * height; ++i) out[i] = (float4)(0.0f);
  for (uint c = 0u; c < chart->corners; ++c) {
    const uint vertex = chart->corner[c];
    for (uint l = leaf_begins[vertex]; l < leaf_begins[vertex + 1u]; ++l) {
      global const kiln_volume_vertex* leaf = fine + leaves[l];
      float3 weights = (float3)(0.0f);
      const uint k = map_project(chart, vload3(0, leaf->position), &weights);
      const float3 normal = vload3(0, leaf->normal);
      // A normal that points the opposite way belongs to another side of the surface; one at a large angle belongs to
      // the polygon beyond a crease, and gets a small weight.
      const float facing = dot3(normal, vload3(0, chart->normal[k]));
      if (!(facing > 0.0f)) continue;
      const float weight = (facing * facing) * (facing * facing);
      const uint second = 1u + k;
      const uint third = 2u + k;
      const float x = (chart->texel[0][0] * weights.x + chart->texel[second][0] * weights.y) +
                      chart->texel[third][0] * weights.z;
      const float y = (chart->texel[0][1] * weights.x + chart->texel[second][1] * weights.y) +
                      chart->texel[third][1] * weights.z;
      if (!(x > -0.5f && y > -0.5f && x < (float)width - 0.5f && y < (float)height - 0.5f))
        continue;
      // Bilinear splat to the four surrounding texels, so that each texel's mean is centred on it.
      const float left = floor(x);
      const float top = floor(y);
      for (int corner = 0; corner < 4; ++corner) {
        const int column = (int)left + (corner & 1);
        const int row = (int)top + (corner >> 1);
        if (column < 0 || row < 0 || column >= width || row >= height) continue;
        const float share = ((corner & 1) != 0 ? x - left : left + 1.0f - x) *
                            ((corner >> 1) != 0 ? y - top : top + 1.0f - y) * weight;
        out[row * width + column] += (float4)(normal * share, share);
      }
    }
  }
  uint known_count = 0u;
  for (int i = 0; i < width * height; ++i) {
    const float4 sum = out[i];
    if (sum.w == 0.0f) continue;
    ++known_count;
    out[i] = (float4)(map_normalize(sum.xyz, vload3(0, chart->normal[0])), 1.0f);
  }
  splatted[item] = known_count;
  if (known_count != 0u) return;
  // If no fine vertex was splatted, the polygon's own vertex normals are used.
  for (uint c = 0u; c < chart->corners; ++c) {
    const int at = (int)chart->texel[c][1] * width + (int)chart->texel[c][0];
    out[at] = (float4)(vload3(chart->corner[c], low_normals), 1.0f);
  }
}

/// Averages the known texels among the 2 x 2 of the finer level under each texel. row_charts: the chart of each row of
/// the level. first_rows: per chart. first_texels: [level][chart].
kernel void kiln_volume_map_push(const kiln_volume_level params,
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
    float3 first = (float3)(0.0f);
    for (int k = 0; k < 4; ++k) {
      const int fx = 2 * x + (k & 1);
      const int fy = 2 * row + (k >> 1);
      if (fx >= fine_width || fy >= fine_height) continue;
      const float4 value = fine[fy * fine_width + fx];
      if (value.w == 0.0f) continue;
      if (sum.w == 0.0f) first = value.xyz;
      sum += value;
    }
    out[x] = sum.w == 0.0f ? (float4)(0.0f) : (float4)(map_normalize(sum.xyz, first), 1.0f);
  }
}

/// Fills unknown texels from the coarser level, all of whose texels are known.
kernel void kiln_volume_map_pull(const kiln_volume_level params,
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
  for (int x = 0; x < width; ++x) {
    if (out[x].w != 0.0f) continue;
    const float4 coarser = coarse[(row >> 1) * coarse_width + (x >> 1)];
    const float4 sum = map_coarser(coarse, coarse_width, coarse_height, x, row);
    out[x] = (float4)(map_normalize(sum.xyz, coarser.xyz), 1.0f);
  }
}

/// Interpolates three consecutive vectors.
static float3 map_interpolate(global const float* corners, float3 weights) {
#pragma OPENCL FP_CONTRACT OFF
  return vload3(0, corners) * weights.x + vload3(1, corners) * weights.y +
         vload3(2, corners) * weights.z;
}

/// Encodes level 0 as the map's values. In tangent space x T + y B + z N restores the normal. The
/// low poly's frame is interpolated and not normalised, as shaders do it (Mikkelsen 2008).
kernel void kiln_volume_map_encode(const kiln_volume_level params,
                                   global const kiln_volume_chart* restrict charts,
                                   global const uint* restrict row_charts,
                                   global const uint* restrict first_rows,
                                   global const kiln_low_shading* restrict shading,
                                   global float4* restrict texels) {
#pragma OPENCL FP_CONTRACT OFF
  const uint item = (uint)get_global_id(0);
  if (item >= params.rows) return;
  const uint index = row_charts[item];
  global const kiln_volume_chart* chart = charts + index;
  const int row = (int)(item - first_rows[index]);
  const int width = (int)chart->size[0];
  global float4* out = texels + chart->first_texel + row * width;
  for (int x = 0; x < width; ++x) {
    const float3 normal = out[x].xyz;
    float3 value = normal;
    if (params.space == KILN_SPACE_TANGENT) {
      const float3 at = (float3)((float)x, (float)row, 1.0f);
      float3 weights = (float3)(0.0f);
      uint best = 0u;
      for (uint k = 0u; k < chart->triangles; ++k) {
        const float3 candidate = map_complete_weights(dot3(vload3(0, chart->weights[k][0]), at),
                                                      dot3(vload3(0, chart->weights[k][1]), at));
        if (k == 0u || map_find_min(candidate) > map_find_min(weights)) {
          weights = candidate;
          best = k;
        }
      }
      // Texels in the padding use the tangent frame at the triangle's edge, since renderers sample the padding there.
      weights = max(weights, 0.0f);
      weights /= (weights.x + weights.y) + weights.z;
      global const kiln_low_shading* low = shading + chart->triangle + best;
      const float3 frame_normal = map_interpolate(low->normal, weights);
      const float3 tangent = map_interpolate(low->tangent, weights);
      const float3 bitangent = cross3(frame_normal, tangent) * low->sign;
      // Cramer's rule without the division by the determinant, which normalising makes unnecessary; only its sign
      // matters.
      const float3 across = cross3(bitangent, frame_normal);
      value = (float3)(dot3(normal, across), dot3(normal, cross3(frame_normal, tangent)),
                       dot3(normal, cross3(tangent, bitangent)));
      if (dot3(tangent, across) < 0.0f) value = -value;
      value = map_normalize(value, (float3)(0.0f, 0.0f, 1.0f));
    }
    value.y *= params.y_scale;
    out[x] = (float4)(value * params.scale + params.offset, 1.0f);
  }
}
