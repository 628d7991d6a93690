// Does a ray meet anything? The first hit found ends the walk; otherwise as in ray.cl.
//
// Rays of ambient occlusion start beside each other but run in all directions. So a work-item takes
// a block of samples and sorts them by the signs of their directions and the largest axis; up to 64
// of one bin at a time walk the tree together (lib/stream.clh).
//
// | kernel                    | global size        | local | reads, writes a sample           |
// | kiln_occlusion_any_stream | samples / 2048, up | 4     | 48 B (56 with reach) + tree, 1 B |
// | kiln_occlusion_any_wide   | samples            | 64    | 24 B (28 with reach) + tree, 1 B |
// | kiln_occlusion_any_scalar | samples            | 64    | the same                         |
//
// The stream's local size is small as a work-item has so much to do: else few groups would be left
// to share.
//
// Defines: KILN_RAY_SCALAR, KILN_PORTABLE_MASKS  as in ray.cl
//          KILN_RAY_SINGLE  build the wide kernel instead of the stream: for CPU drivers that turn
//                           work-items into lanes. llvmpipe takes a minute and more to compile the
//                           stream, and gets it wrong.
// Limits: see ray.cl.
#include "accel/stream.clh"
#include "accel/traverse_scalar.clh"
#include "accel/traverse_wide.clh"

#define KILN_OCCLUSION_BLOCK 2048
#define OCCLUSION_BINS 24  // 8 for each largest axis; one more for what is no ray

#if defined(KILN_RAY_SCALAR) || defined(KILN_RAY_SINGLE)

#ifdef KILN_RAY_SCALAR
kernel void kiln_occlusion_any_scalar(
#else
kernel void kiln_occlusion_any_wide(
#endif
    const kiln_ray_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uchar* restrict occluded) {
  const uint index = params.first + (uint)get_global_id(0);
  if (index >= params.end) return;
  ray_state ray;
  ray_hit hit;
  ray_start(points, index, params, &hit);
  if (ray_load(points, index, params, &ray)) {
#ifdef KILN_RAY_SCALAR
    scalar_trace(nodes, blocks, &ray, 0, true, &hit);
#else
    wide_trace(nodes, blocks, &ray, 0, true, &hit);
#endif
  }
  occluded[index] = hit.triangle != KILN_NO_TRIANGLE ? 1 : 0;
}

#else

/// The bins of 16 samples: 8 kz and the directions' signs; OCCLUSION_BINS where ray_load refuses.
static inline int16 occlusion_bins(const float16 position[3], const float16 direction[3],
                                   float16 offset, const kiln_ray_params params) {
#pragma OPENCL FP_CONTRACT OFF
  float16 size[3];
  int16 octant = (int16)((params.flags & KILN_RAY_INWARD) != 0 ? 7 : 0);
  int16 good = (int16)(-1);
  for (int axis = 0; axis < 3; ++axis) {
    const float16 shift = offset * direction[axis];
    const float16 o = position[axis] + shift;
    octant ^= (as_int16(direction[axis]) >> 31) & (1 << axis);
    size[axis] = fabs(direction[axis]);
    good &= (fabs(o) <= (float16)(KILN_RAY_FARTHEST)) & (size[axis] <= (float16)(2.0f));
  }
  const int16 z0 = (size[0] >= size[1]) & (size[0] >= size[2]);
  const int16 z1 = size[1] >= size[2];
  good &= max(size[0], max(size[1], size[2])) > (float16)(1e-6f);
  const int16 axis_bits = ~z0 & select((int16)(16), (int16)(8), z1);
  return select((int16)(OCCLUSION_BINS), octant | axis_bits, good);
}

/// Sorts samples [first, first + count) by bin: `order` holds their numbers less `first`, `end` the
/// ends of the bins in it.
static KILN_STREAM_CALL void occlusion_sort(global const float* points, uint first, uint count,
                                            const kiln_ray_params params, ushort* order,
                                            uint* end) {
  const bool use_reach = (params.flags & KILN_RAY_USE_REACH) != 0;
  const size_t plane = params.capacity;
  uchar bin_of[KILN_OCCLUSION_BLOCK];
  for (uint i = 0; i < count; i += 16) {
    global const float* sample = points + first + i;
    float16 position[3], direction[3];
    float16 offset = (float16)(params.offset);
    if (count - i >= 16) {
      for (int axis = 0; axis < 3; ++axis) {
        position[axis] = vload16(0, sample + axis * plane);
        direction[axis] = vload16(0, sample + (3 + axis) * plane);
      }
      if (use_reach) offset = vload16(0, sample + 6 * plane);
    } else {
      for (int axis = 0; axis < 3; ++axis) position[axis] = direction[axis] = (float16)(0.0f);
      for (uint k = 0; k < count - i; ++k) {
        for (int axis = 0; axis < 3; ++axis) {
          ((private float*)&position[axis])[k] = sample[axis * plane + k];
          ((private float*)&direction[axis])[k] = sample[(3 + axis) * plane + k];
        }
        if (use_reach) ((private float*)&offset)[k] = sample[6 * plane + k];
      }
    }
    vstore16(convert_uchar16(occlusion_bins(position, direction, offset, params)), 0, bin_of + i);
  }
  for (uint bin = 0; bin <= OCCLUSION_BINS; ++bin) end[bin] = 0;
  for (uint i = 0; i < count; ++i) ++end[bin_of[i]];
  uint sum = 0;
  for (uint bin = 0; bin <= OCCLUSION_BINS; ++bin) {
    const uint size = end[bin];
    end[bin] = sum;
    sum += size;
  }
  for (uint i = 0; i < count; ++i) order[end[bin_of[i]]++] = (ushort)i;
}

/// Traces the samples in `order`, up to 64 of one bin.
static KILN_STREAM_CALL void occlusion_cast(const kiln_ray_params params,
                                            global const kiln_bvh_node* nodes,
                                            global const kiln_bvh_block* blocks,
                                            global const float* points, uint bin,
                                            const ushort* order, uint first, uint count,
                                            global uchar* occluded) {
  ray_stream stream;
  stream.lo = params.t_min;
  stream.hi = params.t_max;
  stream.kz = (int)(bin >> 3);
  stream.kx = stream.kz == 2 ? 0 : stream.kz + 1;
  stream.ky = stream.kx == 2 ? 0 : stream.kx + 1;
  for (int axis = 0; axis < 3; ++axis) stream.near_plane[axis] = (int)(bin >> axis & 1u);
  // By the sample's direction, which is the ray's or its opposite.
  const bool down = ((bin >> stream.kz & 1u) != 0) != ((params.flags & KILN_RAY_INWARD) != 0);
  stream.facing = (params.flags & KILN_RAY_TWO_SIDED) != 0 ? 0.0f : down ? -1.0f : 1.0f;
  for (uint i = 0; i < count; ++i) stream_load(points, first + order[i], params, &stream, i);
  const ulong all = ~(ulong)0 >> (KILN_STREAM_RAYS - count);
  const ulong found = stream_trace(nodes, blocks, &stream, all);
  for (uint i = 0; i < count; ++i) occluded[first + order[i]] = (uchar)(found >> i & 1);
}

kernel void kiln_occlusion_any_stream(
    const kiln_ray_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uchar* restrict occluded) {
  const uint first = params.first + (uint)get_global_id(0) * KILN_OCCLUSION_BLOCK;
  if (first >= params.end) return;
  const uint count = min(params.end - first, (uint)KILN_OCCLUSION_BLOCK);
  ushort order[KILN_OCCLUSION_BLOCK];
  uint end[OCCLUSION_BINS + 1];
  occlusion_sort(points, first, count, params, order, end);
  uint next = 0;
  for (uint bin = 0; bin < OCCLUSION_BINS; ++bin) {
    while (next < end[bin]) {
      const uint rays = min(end[bin] - next, (uint)KILN_STREAM_RAYS);
      occlusion_cast(params, nodes, blocks, points, bin, order + next, first, rays, occluded);
      next += rays;
    }
  }
  for (; next < count; ++next) occluded[first + order[next]] = 0;
}

#endif
