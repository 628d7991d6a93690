// Visibility directions: the mean of the directions from which each point of the low poly is seen,
// past the mesh itself.
//
// After Tarini, Cignoni, Scopigno, "Visibility Based Methods and Assessment for Detail-Recovery" (2003),
// section 3.3: the mesh is drawn from many directions all around, and for each point the directions that
// see it are summed. A direction is weighted by its cosine to the face, as counting pixels does.
//
// kernel                              global         local  memory traffic an item
// kiln_visibility_unpack_depths       pixels         64     reads 8 B, writes 4 B
// kiln_visibility_prepare             samples        64     reads 16 B + 12 B (gathered), writes 24 B
// kiln_visibility_add_to_samples      samples / 64   64     a sample: reads 24 B + 16 B + 4 B a view (gathered),
//                                                           writes 16 B
// kiln_visibility_set_ray_directions  samples        64     reads 12 B, writes 12 B
// kiln_visibility_add_view            samples        64     reads 29 B, writes 16 B
// kiln_visibility_add_to_corners      triangles      64     8 B a pixel of its box in each view; writes 48 B
// kiln_visibility_scatter             samples        64     reads 24 B, writes 20 B
// kiln_visibility_smooth              pixels         64     reads 144 B (mostly shared), writes 16 B
// kiln_visibility_smooth_seams        border pixels  64     reads 36 B + 144 B (gathered), writes 16 B
// kiln_visibility_write_directions    texels         64     a sample: reads 36 B + field, writes 28 B
// kiln_visibility_write_means         texels         64     a sample: reads 16 B + field, writes 12 B
//
// Defines: KILN_VISIBILITY_SCALAR  kiln_visibility_add_to_samples handles one sample per item: for GPUs
//          KILN_VISIBILITY_SEEN  kiln_visibility_add_to_samples and _add_view also store the set of directions
//                                that see a sample, 32 bits per plane of the last argument
//          KILN_LANES, KILN_PORTABLE_MASKS  as in lib/vector.clh, lib/mask.clh
//
// Strengths: a sample costs a projection and one pixel read per view. Limits: occluders narrower than a
// pixel may be missed, as in any depth map.
#include "accel/keys.clh"
#include "lib/vector3.clh"
#include "accel/visibility_lanes.clh"
#include "match/visibility_mean.clh"
#include "shared/common.h"
#include "shared/visibility.h"

/// Converts the keys of a batch of views to depths, row by row.
kernel void kiln_visibility_unpack_depths(const kiln_visibility_params params,
                                          global const kiln_view* restrict views,
                                          global const ulong* restrict keys,
                                          global const uchar* restrict drawn,
                                          global float* restrict depths) {
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const uint size = params.view_size;
  const uint pixel = (uint)i % (size * size);
  const uint first = views[(uint)i / (size * size)].first;
  const ulong key = keys_at(keys, drawn, keys_index(first, size, pixel % size, pixel / size));
  depths[i] = key == KILN_RASTER_EMPTY ? KILN_VISIBILITY_FAR : as_float((uint)(key >> 32));
}

/// Copies samples' positions, with the normals of their faces as directions.
kernel void kiln_visibility_prepare(const kiln_visibility_params params,
                                    global const uint* restrict triangle,
                                    global const float* restrict normals,
                                    global const float* restrict points,
                                    global float* restrict prepared) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const size_t out = params.out_capacity;
  const float3 normal = vload3(triangle[i], normals);
  prepared[i] = points[i] * params.scale;
  prepared[i + out] = points[i + plane] * params.scale;
  prepared[i + 2 * out] = points[i + 2 * plane] * params.scale;
  prepared[i + 3 * out] = normal.x;
  prepared[i + 4 * out] = normal.y;
  prepared[i + 5 * out] = normal.z;
}

/// Adds the directions of a batch of views that see each sample. A view sees a sample if the surface in the sample's
/// pixel is, at the pixel's centre, no nearer than the plane of the sample's face. So a face never hides its own
/// samples, at any angle.
/// \param prepared  6 planes: position, unit normal of the face
/// \param weights   weight of each view
/// \param sums      4 planes: sum of directions x y z, sum of weights
kernel void kiln_visibility_add_to_samples(const kiln_visibility_params params,
                                           global const kiln_view* restrict views,
                                           global const float* restrict weights,
                                           global const float* restrict depths,
                                           global const float* restrict prepared,
                                           global float* restrict sums
#ifdef KILN_VISIBILITY_SEEN
                                           ,
                                           global int* restrict seen_bits
#endif
) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t plane = params.capacity;
#if VISIBILITY_LANES == 1
  const size_t base = get_global_id(0);
  if (base >= params.count) return;
#else
  const size_t base = get_global_id(0) * KILN_VISIBILITY_SAMPLES;
  if (base >= params.count) return;
#endif
  // Arrays are padded to whole work-items, so no lane needs a bounds check.
  const int vectors = VISIBILITY_LANES == 1 ? 1 : KILN_VISIBILITY_SAMPLES / VISIBILITY_LANES;
  const int last = (int)params.view_size - 1;
  for (uint k = 0; k < params.view_count; ++k) {
    global const kiln_view* view = views + k;
    const float weight = weights[k];
    if (!(weight > 0.0f)) continue;
    const float rx = view->right[0], ry = view->right[1], rz = view->right[2];
    const float ux = view->up[0], uy = view->up[1], uz = view->up[2];
    const float tx = view->toward[0], ty = view->toward[1], tz = view->toward[2];
    global const float* picture = depths + (size_t)k * params.view_size * params.view_size;
    for (int j = 0; j < vectors; ++j) {
      global const float* sample = prepared + base + j * VISIBILITY_LANES;
      const vfloat nx = visibility_load(sample + 3 * plane);
      const vfloat ny = visibility_load(sample + 4 * plane);
      const vfloat nz = visibility_load(sample + 5 * plane);
      const vfloat cosine = (nx * tx + ny * ty) + nz * tz;
      const vint facing = cosine > (vfloat)(KILN_VISIBILITY_LEAST_COSINE);
      if (!visibility_any(facing)) continue;
      const vfloat px = visibility_load(sample);
      const vfloat py = visibility_load(sample + plane);
      const vfloat pz = visibility_load(sample + 2 * plane);
      const vfloat x = ((px * rx + py * ry) + pz * rz) * view->scale + view->left;
      const vfloat y = view->top - ((px * ux + py * uy) + pz * uz) * view->scale;
      const vfloat depth = KILN_RASTER_FAR - ((px * tx + py * ty) + pz * tz);
      const vint column = clamp(visibility_to_int(x), (vint)(0), (vint)(last));
      const vint row = clamp(visibility_to_int(y), (vint)(0), (vint)(last));
      const vfloat offset_x = (visibility_to_float(column) + 0.5f) - x;
      const vfloat offset_y = (visibility_to_float(row) + 0.5f) - y;
      const vfloat slope_x = (nx * rx + ny * ry) + nz * rz;
      const vfloat slope_y = (nx * ux + ny * uy) + nz * uz;
      const vfloat picture_depth = visibility_gather(picture, row * (last + 1) + column);
      const vint seen = facing & (slope_x * offset_x - slope_y * offset_y <=
                                  ((picture_depth + params.bias) - depth) * (cosine * view->scale));
      if (!visibility_any(seen)) continue;
#ifdef KILN_VISIBILITY_SEEN
      const uint direction = params.first_direction + k;
      global int* bits = seen_bits + (direction / 32) * plane + base + j * VISIBILITY_LANES;
      visibility_store(
          visibility_load(bits) | (seen ? (vint)(1 << (direction % 32)) : (vint)(0)), bits);
#endif
      const vfloat share = seen ? cosine * weight : (vfloat)(0.0f);
      global float* sum = sums + base + j * VISIBILITY_LANES;
      visibility_store(visibility_load(sum) + share * tx, sum);
      visibility_store(visibility_load(sum + plane) + share * ty, sum + plane);
      visibility_store(visibility_load(sum + 2 * plane) + share * tz, sum + 2 * plane);
      visibility_store(visibility_load(sum + 3 * plane) + share, sum + 3 * plane);
    }
  }
}

/// Sets samples' directions towards a view, for rays; samples on faces turned away get no
/// direction, and so no ray.
kernel void kiln_visibility_set_ray_directions(const kiln_visibility_params params,
                                               global const kiln_view* restrict views, const uint view,
                                               global const float* restrict prepared,
                                               global float* restrict rays) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const float3 normal =
      (float3)(prepared[i + 3 * plane], prepared[i + 4 * plane], prepared[i + 5 * plane]);
  const float3 toward = vload3(0, views[view].toward);
  const bool facing = dot3(normal, toward) > KILN_VISIBILITY_LEAST_COSINE;
  rays[i + 3 * plane] = facing ? toward.x : 0.0f;
  rays[i + 4 * plane] = facing ? toward.y : 0.0f;
  rays[i + 5 * plane] = facing ? toward.z : 0.0f;
}

/// Adds a view's direction to the samples whose rays towards it have no hit.
kernel void kiln_visibility_add_view(const kiln_visibility_params params,
                                     global const kiln_view* restrict views, const uint view,
                                     const float weight, global const float* restrict prepared,
                                     global const uchar* restrict hidden, global float* restrict sums
#ifdef KILN_VISIBILITY_SEEN
                                     ,
                                     global int* restrict seen_bits
#endif
) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const float3 normal =
      (float3)(prepared[i + 3 * plane], prepared[i + 4 * plane], prepared[i + 5 * plane]);
  const float3 toward = vload3(0, views[view].toward);
  const float cosine = dot3(normal, toward);
  if (hidden[i] != 0 || !(cosine > KILN_VISIBILITY_LEAST_COSINE)) return;
#ifdef KILN_VISIBILITY_SEEN
  const uint direction = params.first_direction + view;
  seen_bits[(direction / 32) * plane + i] |= 1 << (direction % 32);
#endif
  const float share = cosine * weight;
  sums[i] += share * toward.x;
  sums[i + plane] += share * toward.y;
  sums[i + 2 * plane] += share * toward.z;
  sums[i + 3 * plane] += share;
}

/// Adds the directions of a batch of views to the corners of each triangle: each visible pixel of
/// the triangle adds the view's direction to the three corners, by the pixel's barycentric weights.
/// \param corners  [triangle][corner][sum of directions x y z, sum of weights]
kernel void kiln_visibility_add_to_corners(
    const kiln_visibility_params params, global const kiln_view* restrict views,
    global const float* restrict weights, global const ulong* restrict keys,
    global const uchar* restrict drawn, global const uint* restrict triangles,
    global const float* restrict positions, global float* restrict corners) {
#pragma OPENCL FP_CONTRACT OFF
  const uint t = (uint)get_global_id(0);
  if (t >= params.count) return;
  const uint3 index = vload3(t, triangles);
  if (index.x == index.y || index.y == index.z || index.z == index.x) return;
  const float3 a = vload3(index.x, positions);
  const float3 b = vload3(index.y, positions);
  const float3 c = vload3(index.z, positions);
  float4 sum[3];
  for (int i = 0; i < 3; ++i) sum[i] = vload4(3 * t + i, corners);
  for (uint k = 0; k < params.view_count; ++k) {
    global const kiln_view* view = views + k;
    const float3 right = vload3(0, view->right);
    const float3 up = vload3(0, view->up);
    const float3 toward = vload3(0, view->toward);
    const float ax = dot3(right, a) * view->scale + view->left;
    const float bx = dot3(right, b) * view->scale + view->left;
    const float cx = dot3(right, c) * view->scale + view->left;
    const float ay = view->top - dot3(up, a) * view->scale;
    const float by = view->top - dot3(up, b) * view->scale;
    const float cy = view->top - dot3(up, c) * view->scale;
    // Row indices grow downwards, so triangles that face the viewer have clockwise corners here.
    const float area = (cx - ax) * (by - ay) - (bx - ax) * (cy - ay);
    if (!(area > 0.0f)) continue;
    const int size = (int)params.view_size;
    const int first_x = max(0, (int)min(ax, min(bx, cx)) - 1);
    const int first_y = max(0, (int)min(ay, min(by, cy)) - 1);
    const int last_x = min(size - 1, (int)max(ax, max(bx, cx)) + 1);
    const int last_y = min(size - 1, (int)max(ay, max(by, cy)) + 1);
    float share_b = 0.0f;
    float share_c = 0.0f;
    uint count = 0;
    for (int y = first_y; y <= last_y; ++y) {
      for (int x = first_x; x <= last_x; ++x) {
        const ulong key =
            keys_at(keys, drawn, keys_index(view->first, (uint)size, (uint)x, (uint)y));
        if (key == KILN_RASTER_EMPTY || (uint)key != t) continue;
        const float px = (float)x + 0.5f;
        const float py = (float)y + 0.5f;
        ++count;
        share_b += clamp(((cx - ax) * (py - ay) - (px - ax) * (cy - ay)) / area, 0.0f, 1.0f);
        share_c += clamp(((px - ax) * (by - ay) - (bx - ax) * (py - ay)) / area, 0.0f, 1.0f);
      }
    }
    if (count == 0) continue;
    const float total = (float)count;
    const float share_a = max(0.0f, (total - share_b) - share_c);
    const float4 direction = (float4)(toward, 1.0f) * weights[k];
    sum[0] += direction * share_a;
    sum[1] += direction * share_b;
    sum[2] += direction * share_c;
  }
  for (int i = 0; i < 3; ++i) vstore4(sum[i], 3 * t + i, corners);
}

/// Scatters a band's sums to their texels in the field.
/// \param first  number of the field's pixels before the band
kernel void kiln_visibility_scatter(const kiln_visibility_params params, const uint first,
                                    global const uint* restrict texel_index,
                                    global const uint* restrict triangle,
                                    global const float* restrict sums, global float* restrict field,
                                    global uint* restrict field_triangle) {
  const size_t i = get_global_id(0);
  if (i >= params.count) return;
  const size_t plane = params.capacity;
  const size_t pixel = (size_t)first + texel_index[i];
  vstore4((float4)(sums[i], sums[i + plane], sums[i + 2 * plane], sums[i + 3 * plane]), pixel,
          field);
  field_triangle[pixel] = triangle[i];
}

/// One smoothing pass with the weights 4, 2, 1 for the texel, its side neighbours and its diagonal neighbours. Sums of
/// directions and sums of weights are smoothed alike, so well-sampled texels count more.
/// \param width  of the field
kernel void kiln_visibility_smooth(const uint count, const uint width,
                                   global const uchar* restrict kind,
                                   global const float* restrict from, global float* restrict to) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= count || kind[i] != KILN_VISIBILITY_INNER) return;
  const size_t row_above = i - width;
  const size_t row_below = i + width;
  const float4 near4 =
      (vload4(row_above, from) + vload4(row_below, from)) + (vload4(i - 1, from) + vload4(i + 1, from));
  const float4 diagonal_sum = (vload4(row_above - 1, from) + vload4(row_above + 1, from)) +
                     (vload4(row_below - 1, from) + vload4(row_below + 1, from));
  vstore4((vload4(i, from) * 4.0f + near4 * 2.0f + diagonal_sum) * 0.0625f, i, to);
}

/// The same smoothing pass for texels with neighbours across a seam.
/// \param links  [9 * count] the texel, then its neighbours: left, right, above, below, and the diagonal
///               ones; the texel itself replaces those with KILN_VISIBILITY_NO_LINK
kernel void kiln_visibility_smooth_seams(const uint count, global const uint* restrict links,
                                         global const float* restrict from, global float* restrict to) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t i = get_global_id(0);
  if (i >= count) return;
  global const uint* link = links + 9 * i;
  const size_t texel = link[0];
  float4 sum = vload4(texel, from) * 4.0f;
  for (int k = 1; k < 9; ++k) {
    const size_t other = link[k] == KILN_VISIBILITY_NO_LINK ? texel : (size_t)link[k];
    sum += vload4(other, from) * (k < 5 ? 2.0f : 1.0f);
  }
  vstore4(sum * 0.0625f, texel, to);
}

/// Writes a band's samples with their visibility directions. For the hybrid, (1 - s) of the
/// visibility direction is blended with s of the sample's own direction, s being the standard
/// deviation of the directions that see the sample (section 3.4, equation 3).
/// \param field mean directions, whose length measures their agreement: per texel, or [3 * triangles]
///               per corner; w is 1, or 0 if no direction sees it
/// \param chart  chart of each triangle
/// \param normals  normals of the low poly's faces
kernel void kiln_visibility_write_directions(
    const kiln_visibility_band params, global const uint* restrict texel_index,
    global const uint* restrict texel_first, global const uint* restrict sample_slot,
    global const uint* restrict triangle, global const float* restrict barycentric,
    global const float* restrict points, global const float* restrict normals,
    global const float* restrict field, global const uint* restrict field_triangle,
    global const uint* restrict chart, global const uint* restrict border,
    global const uint* restrict links, global float* restrict directed) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t texel = get_global_id(0);
  if (texel >= params.texel_count) return;
  const size_t plane = params.capacity;
  const size_t out = params.out_capacity;
  const uint index = texel_index[texel];
  const uint end = texel_first[texel + 1];
  for (uint i = texel_first[texel]; i < end; ++i) {
    const uint own_triangle = triangle[i];
    const float3 mean = visibility_compute_mean(&params, index, i, own_triangle, sample_slot, barycentric, field,
                                                field_triangle, chart, border, links);
    const float3 own_direction =
        (float3)(points[i + 3 * plane], points[i + 4 * plane], points[i + 5 * plane]);
    float3 direction = own_direction;
    const float mean_length = sqrt(dot3(mean, mean));
    if (mean_length > 1e-4f) {
      direction = mean / mean_length;
      if (params.hybrid != 0) {
        const float deviation = sqrt(max(0.0f, 1.0f - mean_length * mean_length));
        direction = direction * (1.0f - deviation) + own_direction * deviation;
      }
      const float3 normal = vload3(own_triangle, normals);
      const float size = sqrt(dot3(direction, direction));
      direction = size > 1e-4f ? direction / size : own_direction;
      const float rise = dot3(direction, normal);
      if (rise < KILN_VISIBILITY_LEAST_RISE) {
        direction = direction + normal * (KILN_VISIBILITY_LEAST_RISE - rise);
        direction = direction / sqrt(dot3(direction, direction));
      }
    }
    directed[i] = points[i];
    directed[i + out] = points[i + plane];
    directed[i + 2 * out] = points[i + 2 * plane];
    directed[i + 3 * out] = direction.x;
    directed[i + 4 * out] = direction.y;
    directed[i + 5 * out] = direction.z;
    directed[i + 6 * out] = points[i + 6 * plane];
  }
}

/// Writes the mean of the directions that see each of a band's samples; arguments as for
/// kiln_visibility_write_directions.
/// \param seen  3 planes
kernel void kiln_visibility_write_means(
    const kiln_visibility_band params, global const uint* restrict texel_index,
    global const uint* restrict texel_first, global const uint* restrict sample_slot,
    global const uint* restrict triangle, global const float* restrict barycentric,
    global const float* restrict field, global const uint* restrict field_triangle,
    global const uint* restrict chart, global const uint* restrict border,
    global const uint* restrict links, global float* restrict seen) {
#pragma OPENCL FP_CONTRACT OFF
  const size_t texel = get_global_id(0);
  if (texel >= params.texel_count) return;
  const size_t out = params.out_capacity;
  const uint index = texel_index[texel];
  const uint end = texel_first[texel + 1];
  for (uint i = texel_first[texel]; i < end; ++i) {
    const float3 mean = visibility_compute_mean(&params, index, i, triangle[i], sample_slot, barycentric,
                                                field, field_triangle, chart, border, links);
    seen[i] = mean.x;
    seen[i + out] = mean.y;
    seen[i + 2 * out] = mean.z;
  }
}
