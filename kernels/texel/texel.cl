// Scan conversion of the low poly's UV triangles into samples.
//
// Purpose: finds the UV triangle that covers each sample of a band of the map, and writes for the
// covered samples, compacted, barycentric weights, the point on the surface and the ray direction.
//
// Algorithm: exact integer edge functions (Pineda 1988, "A Parallel Algorithm for Polygon
// Rasterization") with the top-left rule, evaluated for eight samples at a time. For each block of about
// 8 x 8 samples, the host lists the pieces (triangles, or parts of clipped ones) that may overlap it, in
// ascending order; one work-item processes a block's list, so the lowest triangle wins without atomics.
// The host converts the counts to offsets, and the second kernel compacts the samples.
//
// | kernel                     | one work-item | traffic                                                     |
// | kiln_texel_cover           | block         | 64 B a listed piece; 4 B a sample, hot in cache              |
// | kiln_texel_fill            | block         | 176 B a piece in the block; 48 B a covered sample, 8 a texel |
// | kiln_texel_gather,          kiln_texel_gather_bytes | sample | 4 B, and 8 B or 2 B a plane                      |
// | kiln_texel_scatter_results _results | sample      | 8 B; 34 B more if a point was found                           |
//
// Local size 64; any other works. No defines. All integer arithmetic is exact: |a|, |b| < 2^30, samples
// up to 2^18 a side, |E| < 2^61. Floating point: +, -, *, fma, / and sqrt, correctly rounded.
//
// Strengths: no atomics, no sorting on the device; eight lanes for any N. Limits: one work-item
// processes a list, so thousands of triangles in one block are slow.
#include "lib/call.clh"
#include "shared/common.h"
#include "shared/texel.h"

// The table of slots consists of arrays (planes) of 8 * group_count values. Slots that only pad the last group have x =
// 2^18, outside of any map.
#define TEXEL_PLANE_X 0u      // sample within the block
#define TEXEL_PLANE_Y 1u
#define TEXEL_PLANE_PLACE 2u  // sample within the texel: sy * N + sx
#define TEXEL_PLANE_TEXEL 3u  // entry t: texel t of the block, row * width + column

/// Finds the piece that covers each slot of a block, and counts samples, texels and overlaps.
static KILN_CALL void texel_cover(const size_t index, const kiln_texel_params params,
                                  global const kiln_texel_block* KILN_CALL_RESTRICT blocks,
                                  global const uint* KILN_CALL_RESTRICT lists,
                                  global const kiln_texel_piece* KILN_CALL_RESTRICT pieces,
                                  global const int* KILN_CALL_RESTRICT slots, global uint* KILN_CALL_RESTRICT ids,
                                  global uint* KILN_CALL_RESTRICT counts) {
  const kiln_texel_block block = blocks[index];
  const uint groups = params.group_count;
  const size_t pitch = 8u * (size_t)groups;
  global uint* block_ids = ids + index * pitch;
  global const int* slot_x = slots + TEXEL_PLANE_X * pitch;
  global const int* slot_y = slots + TEXEL_PLANE_Y * pitch;

  for (uint g = 0u; g < groups; ++g) vstore8((uint8)(KILN_TEXEL_EMPTY), g, block_ids);

  for (uint entry = block.list_begin; entry < block.list_end; ++entry) {
    const uint id = lists[entry];
    global const kiln_texel_piece* piece = pieces + id;
    // A sample is inside if E >= 0, or if E > 0 for open edges. E is computed without its lowest bits, which are equal
    // for all samples.
    const long a0 = piece->a[0], a1 = piece->a[1], a2 = piece->a[2];
    const long b0 = piece->b[0], b1 = piece->b[1], b2 = piece->b[2];
    const uint open = ~piece->closed;
    const long c0 = ((piece->c[0] - (long)(open & 1u)) >> params.shift) + a0 * block.x + b0 * block.y;
    const long c1 =
        ((piece->c[1] - (long)((open >> 1) & 1u)) >> params.shift) + a1 * block.x + b1 * block.y;
    const long c2 =
        ((piece->c[2] - (long)((open >> 2) & 1u)) >> params.shift) + a2 * block.x + b2 * block.y;
    const uint first = piece->first;
    for (uint g = 0u; g < groups; ++g) {
      const int8 x = vload8(g, slot_x);
      const int8 y = vload8(g, slot_y);
      const long8 lx = convert_long8(x);
      const long8 ly = convert_long8(y);
      const long8 e = (lx * a0 + ly * b0 + c0) | (lx * a1 + ly * b1 + c1) | (lx * a2 + ly * b2 + c2);
      const int8 inside = (convert_int8(e >> 32) >= 0) & (x + block.x < params.sample_width) &
                          (y + block.y < params.sample_height);
      const uint8 current_ids = vload8(g, block_ids);
      const int8 first_cover = inside & (current_ids == KILN_TEXEL_EMPTY);
      const int8 is_overlap = inside & ((current_ids & KILN_TEXEL_EMPTY) < first);
      const uint8 new_ids = select(current_ids, (uint8)(id), as_uint8(first_cover));
      vstore8(select(new_ids, current_ids | KILN_TEXEL_OVERLAP, as_uint8(is_overlap)), g, block_ids);
    }
  }

  uint samples = 0u;
  uint texels = 0u;
  uint overlaps = 0u;
  for (uint t = 0u; t < params.block_texels; ++t) {
    uint covered = 0u;
    for (uint s = 0u; s < params.texel_samples; ++s) {
      const uint id = block_ids[t * params.texel_samples + s];
      covered += id != KILN_TEXEL_EMPTY ? 1u : 0u;
      overlaps += id >> 31;
    }
    samples += covered;
    texels += covered != 0u ? 1u : 0u;
  }
  counts[index] = samples | (texels << 10) | (overlaps << 20);
}

kernel void kiln_texel_cover(const kiln_texel_params params,
                             global const kiln_texel_block* restrict blocks,
                             global const uint* restrict lists,
                             global const kiln_texel_piece* restrict pieces,
                             global const int* restrict slots,
                             global uint* restrict ids,
                             global uint* restrict counts) {
  const size_t index = get_global_id(0);
  if (index >= params.block_count) return;
  texel_cover(index, params, blocks, lists, pieces, slots, ids, counts);
}

/// Barycentric weight of a corner: its edge function divided by the doubled area. Errors: the
/// last bits of a 31-bit fraction, and one rounding each of conversion, reciprocal and product.
static inline float8 texel_compute_weight(const long a, const long b, const long c, const int8 x, const int8 y,
                    const uint shift, const uint drop, const float reciprocal) {
#pragma OPENCL FP_CONTRACT OFF
  const long8 e = ((convert_long8(x) * a + convert_long8(y) * b) << (long8)((long)shift)) + c;
  const int8 fraction = convert_int8(as_ulong8(e) >> (ulong8)((ulong)drop));
  return min(convert_float8(fraction) * reciprocal, 1.0f);
}

static inline float8 texel_blend(const float v0, const float v1, const float v2, const float8 w0, const float8 w1,
                   const float8 w2) {
#pragma OPENCL FP_CONTRACT OFF
  return fma(w2, (float8)(v2), fma(w1, (float8)(v1), w0 * v0));
}

/// Counts the lanes that are true.
static inline int texel_count_lanes(const int8 lanes) {
  const int4 pairs = lanes.lo + lanes.hi;
  return -(pairs.x + pairs.y + pairs.z + pairs.w);
}

/// Unit normal of a triangle, used where interpolated directions cancel out.
static inline float3 texel_compute_face_normal(global const kiln_texel_corners* corners) {
#pragma OPENCL FP_CONTRACT OFF
  const float3 p = vload3(0, corners->position);
  const float3 e = vload3(1, corners->position) - p;
  const float3 f = vload3(2, corners->position) - p;
  float3 n = (float3)(e.y * f.z - e.z * f.y, e.z * f.x - e.x * f.z, e.x * f.y - e.y * f.x);
  const float largest = max(max(fabs(n.x), fabs(n.y)), fabs(n.z));
  if (!(largest > 1e-30f)) return (float3)(0.0f, 0.0f, 1.0f);
  n = n / largest;
  return n / sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
}

/// Compacts the covered slots of a block into the band's arrays, with points and barycentrics.
static KILN_CALL void texel_fill(const size_t index, const kiln_texel_params params,
                                 global const kiln_texel_block* KILN_CALL_RESTRICT blocks,
                                 global const uint* KILN_CALL_RESTRICT first_samples,
                                 global const uint* KILN_CALL_RESTRICT first_texels,
                                 global const kiln_texel_piece* KILN_CALL_RESTRICT pieces,
                                 global const kiln_texel_corners* KILN_CALL_RESTRICT corners,
                                 global const int* KILN_CALL_RESTRICT slots, global const uint* KILN_CALL_RESTRICT ids,
                                 global uint* KILN_CALL_RESTRICT texel_index,
                                 global uint* KILN_CALL_RESTRICT texel_first,
                                 global uint* KILN_CALL_RESTRICT sample_slot, global uint* KILN_CALL_RESTRICT triangle,
                                 global float* KILN_CALL_RESTRICT barycentric,
                                 global float* KILN_CALL_RESTRICT points) {
#pragma OPENCL FP_CONTRACT OFF
  const kiln_texel_block block = blocks[index];
  const size_t pitch = 8u * (size_t)params.group_count;
  const size_t plane = params.capacity;
  global const uint* block_ids = ids + index * pitch;
  uint sample = first_samples[index];

  // Writes the block's texels, and the index of each texel's first sample.
  const uint origin = ((uint)block.y / params.samples - params.first_row) * params.width +
                      (uint)block.x / params.samples;
  uint texel = first_texels[index];
  uint cursor = sample;
  for (uint t = 0u; t < params.block_texels; ++t) {
    uint covered = 0u;
    for (uint s = 0u; s < params.texel_samples; ++s) {
      covered += block_ids[t * params.texel_samples + s] != KILN_TEXEL_EMPTY ? 1u : 0u;
    }
    if (covered == 0u) continue;
    texel_index[texel] = origin + (uint)slots[TEXEL_PLANE_TEXEL * pitch + t];
    texel_first[texel] = cursor;
    ++texel;
    cursor += covered;
  }

  for (uint g = 0u; g < params.group_count; ++g) {
    uint8 id = vload8(g, block_ids) & KILN_TEXEL_EMPTY;
    const int8 covered = id != KILN_TEXEL_EMPTY;
    const int count = texel_count_lanes(covered);
    if (count == 0) continue;
    const int8 x = vload8(g, slots + TEXEL_PLANE_X * pitch) + block.x;
    const int8 y = vload8(g, slots + TEXEL_PLANE_Y * pitch) + block.y;
    uint8 owner = (uint8)(0u);
    float8 u = (float8)(0.0f), v = (float8)(0.0f);
    float8 px = (float8)(0.0f), py = (float8)(0.0f), pz = (float8)(0.0f);
    float8 dx = (float8)(0.0f), dy = (float8)(0.0f), dz = (float8)(0.0f);

    // The loop has one iteration per distinct piece among the eight samples; mostly there is only one piece.
    uint pending[8];
    vstore8(id, 0, pending);
    int remaining = count;
    for (uint lane = 0u; lane < 8u && remaining > 0; ++lane) {
      const uint piece = pending[lane];
      if (piece == KILN_TEXEL_EMPTY) continue;
      global const kiln_texel_piece* p = pieces + piece;
      global const kiln_texel_corners* c = corners + piece;
      float8 w1 = texel_compute_weight(p->a[1], p->b[1], p->c[1], x, y, params.shift, p->drop, c->reciprocal);
      float8 w2 = texel_compute_weight(p->a[2], p->b[2], p->c[2], x, y, params.shift, p->drop, c->reciprocal);
      w2 = min(w2, 1.0f - w1);
      const float8 w0 = 1.0f - w1 - w2;
      const int8 lane_mask = id == piece;
      remaining -= texel_count_lanes(lane_mask);
      owner = select(owner, (uint8)(p->triangle), as_uint8(lane_mask));
      const float8 u_whole = min(
          max(texel_blend(c->weight1[0], c->weight1[1], c->weight1[2], w0, w1, w2), 0.0f), 1.0f);
      const float8 v_whole =
          max(texel_blend(c->weight2[0], c->weight2[1], c->weight2[2], w0, w1, w2), 0.0f);
      u = select(u, u_whole, lane_mask);
      v = select(v, min(v_whole, 1.0f - u_whole), lane_mask);
      px = select(px, texel_blend(c->position[0], c->position[3], c->position[6], w0, w1, w2), lane_mask);
      py = select(py, texel_blend(c->position[1], c->position[4], c->position[7], w0, w1, w2), lane_mask);
      pz = select(pz, texel_blend(c->position[2], c->position[5], c->position[8], w0, w1, w2), lane_mask);
      dx = select(dx, texel_blend(c->direction[0], c->direction[3], c->direction[6], w0, w1, w2), lane_mask);
      dy = select(dy, texel_blend(c->direction[1], c->direction[4], c->direction[7], w0, w1, w2), lane_mask);
      dz = select(dz, texel_blend(c->direction[2], c->direction[5], c->direction[8], w0, w1, w2), lane_mask);
      vstore8(select(vload8(0, pending), (uint8)(KILN_TEXEL_EMPTY), as_uint8(lane_mask)), 0, pending);
    }

    const float8 squared = fma(dz, dz, fma(dy, dy, dx * dx));
    const int8 is_zero = squared < 1e-30f;
    const float8 reach = select(sqrt(squared), (float8)(0.0f), is_zero);
    const float8 divisor = select(reach, (float8)(1.0f), is_zero);
    dx = dx / divisor;
    dy = dy / divisor;
    dz = dz / divisor;
    const int8 needs_normal = is_zero & covered;
    const int4 normal_pairs = needs_normal.lo | needs_normal.hi;
    if ((normal_pairs.x | normal_pairs.y | normal_pairs.z | normal_pairs.w) != 0) {
      float fallback[24];
      vstore8(dx, 0, fallback);
      vstore8(dy, 1, fallback);
      vstore8(dz, 2, fallback);
      uint piece_of[8];
      int is_lost[8];
      vstore8(id, 0, piece_of);
      vstore8(needs_normal, 0, is_lost);
      for (uint lane = 0u; lane < 8u; ++lane) {
        if (is_lost[lane] == 0) continue;
        const float3 normal = texel_compute_face_normal(corners + piece_of[lane]);
        fallback[lane] = normal.x;
        fallback[8u + lane] = normal.y;
        fallback[16u + lane] = normal.z;
      }
      dx = vload8(0, fallback);
      dy = vload8(1, fallback);
      dz = vload8(2, fallback);
    }

    const uint8 slot_in_texel = as_uint8(vload8(g, slots + TEXEL_PLANE_PLACE * pitch));
    if (count == 8) {
      vstore8(slot_in_texel, 0, sample_slot + sample);
      vstore8(owner, 0, triangle + sample);
      vstore8(u, 0, barycentric + sample);
      vstore8(v, 0, barycentric + plane + sample);
      vstore8(px, 0, points + sample);
      vstore8(py, 0, points + plane + sample);
      vstore8(pz, 0, points + 2u * plane + sample);
      vstore8(dx, 0, points + 3u * plane + sample);
      vstore8(dy, 0, points + 4u * plane + sample);
      vstore8(dz, 0, points + 5u * plane + sample);
      vstore8(reach, 0, points + 6u * plane + sample);
      sample += 8u;
      continue;
    }
    uint integers[24];
    float floats[72];
    vstore8(as_uint8(covered), 0, integers);
    vstore8(slot_in_texel, 1, integers);
    vstore8(owner, 2, integers);
    vstore8(u, 0, floats);
    vstore8(v, 1, floats);
    vstore8(px, 2, floats);
    vstore8(py, 3, floats);
    vstore8(pz, 4, floats);
    vstore8(dx, 5, floats);
    vstore8(dy, 6, floats);
    vstore8(dz, 7, floats);
    vstore8(reach, 8, floats);
    for (uint lane = 0u; lane < 8u; ++lane) {
      if (integers[lane] == 0u) continue;
      sample_slot[sample] = integers[8u + lane];
      triangle[sample] = integers[16u + lane];
      barycentric[sample] = floats[lane];
      barycentric[plane + sample] = floats[8u + lane];
      for (uint k = 0u; k < 7u; ++k) points[k * plane + sample] = floats[16u + 8u * k + lane];
      ++sample;
    }
  }
}

kernel void kiln_texel_fill(const kiln_texel_params params,
                            global const kiln_texel_block* restrict blocks,
                            global const uint* restrict first_samples,  // per block
                            global const uint* restrict first_texels,
                            global const kiln_texel_piece* restrict pieces,
                            global const kiln_texel_corners* restrict corners,
                            global const int* restrict slots,
                            global const uint* restrict ids,
                            global uint* restrict texel_index,
                            global uint* restrict texel_first,
                            global uint* restrict sample_slot,
                            global uint* restrict triangle,
                            global float* restrict barycentric,
                            global float* restrict points) {
  const size_t index = get_global_id(0);
  if (index >= params.block_count) return;
  texel_fill(index, params, blocks, first_samples, first_texels, pieces, corners, slots, ids,
             texel_index, texel_first, sample_slot, triangle, barycentric, points);
}

/// Copies the values of selected samples into a compact array; the rest of `to` is filled with zeros.
kernel void kiln_texel_gather(const uint count,
                              const uint planes,
                              const uint from_capacity,
                              const uint to_capacity,
                              global const uint* restrict samples,
                              global const uint* restrict from,  // values of any 4-byte type
                              global uint* restrict to) {
  const size_t i = get_global_id(0);
  if (i >= to_capacity) return;
  for (size_t plane = 0; plane < planes; ++plane) {
    to[plane * to_capacity + i] = i < count ? from[plane * from_capacity + samples[i]] : 0u;
  }
}

/// kiln_texel_gather for values of one byte.
kernel void kiln_texel_gather_bytes(const uint count,
                                    const uint planes,
                                    const uint from_capacity,
                                    const uint to_capacity,
                                    global const uint* restrict samples,
                                    global const uchar* restrict from,
                                    global uchar* restrict to) {
  const size_t i = get_global_id(0);
  if (i >= to_capacity) return;
  for (size_t plane = 0; plane < planes; ++plane) {
    to[plane * to_capacity + i] = i < count ? from[plane * from_capacity + samples[i]] : (uchar)0;
  }
}

/// Copies the results of selected samples from compact arrays back to the samples' positions.
kernel void kiln_texel_scatter_results(const uint count,
                                       const uint found_capacity,
                                       const uint match_capacity,
                                       global const uint* restrict samples,
                                       global const uint* restrict triangle,
                                       global const float* restrict barycentric,
                                       global const float* restrict distance,
                                       global const uchar* restrict status,
                                       global uint* restrict match_triangle,
                                       global float* restrict match_barycentric,
                                       global float* restrict match_distance,
                                       global uchar* restrict match_status) {
  const size_t i = get_global_id(0);
  if (i >= count || triangle[i] == KILN_NO_TRIANGLE) return;
  const size_t to = samples[i];
  match_triangle[to] = triangle[i];
  match_barycentric[to] = barycentric[i];
  match_barycentric[to + match_capacity] = barycentric[i + found_capacity];
  match_distance[to] = distance[i];
  match_status[to] = status[i];
}
