// Nearest hits of neighbouring rays, as streams (stream.clh).
//
// Where texels are about as large as triangles, a beam (beam.clh) reaches many leaves, and each of them is hit by few
// of its rays. A stream tests boxes ray by ray, 16 at a time, and triangles only against the rays that reach their leaf.
//
// Neighbouring rays run in similar directions, but a stream's rays must have the same signs and the same dominant axis.
// So of a block of 256 samples, each run of 64 that is a stream already is cast as it is, and the others are sorted into
// bins. Of a scan's texels at 1024 x 1024, streams then have 49 rays in the mean; with blocks of 64, 38.
//
// A ray's interval shortens with each hit; which hit counts does not depend on the order (ray_accept() of ray.clh).
//
// | kernel                  | global size       | local | reads, writes a sample            |
// | kiln_ray_closest_stream | samples / 256, up | 16    | 48 B (56 with reach) + tree, 17 B |
//
// Defines: KILN_PORTABLE_MASKS  no x86 instructions (lib/mask.clh)
//          KILN_BVH_PLAIN       the tree has no prisms (prism.clh)
// Limits: see ray.cl.
#define STREAM_HITS 1
#include "accel/stream_hits.clh"
#include "accel/stream.clh"

#define RAY_STREAM_RUNS (KILN_RAY_STREAM_BLOCK / KILN_STREAM_RAYS)

/// The arrays that receive results.
typedef struct {
  global uint* triangle;
  global float* barycentric;
  global float* distance;
  global uchar* status;
} ray_stream_results;

/// Writes the correspondences of samples [first, first + 64), as ray_store() does for one ray.
static inline void ray_stream_store(const stream_hits* hits, global const float* points, uint first,
                                    const kiln_ray_params params, const ray_stream_results* results) {
#pragma OPENCL FP_CONTRACT OFF
  const bool inward = (params.flags & KILN_RAY_INWARD) != 0;
  const bool use_reach = (params.flags & KILN_RAY_USE_REACH) != 0;
  const float sign = inward ? -1.0f : 1.0f;
  for (uint n = 0; n < STREAM_VECTORS; ++n) {
    const float16 t = vload16(n, hits->t);
    const uint16 triangle = vload16(n, hits->triangle);
    const int16 found = triangle != (uint16)(KILN_NO_TRIANGLE);
    const float16 offset =
        use_reach ? vload16(n, points + 6 * (size_t)params.capacity + first) : (float16)(params.offset);
    const float16 signed_t = sign * t;
    const int16 kind = inward ? (int16)(KILN_STATUS_CAGE)
                              : select((int16)(KILN_STATUS_INWARD), (int16)(KILN_STATUS_OUTWARD), t >= 0.0f);
    const int16 multiple_hit_bits = as_int16(vload16(n, hits->multiple_hits)) * (int16)(KILN_RAY_SEVERAL);
    vstore16(triangle, n, results->triangle + first);
    vstore16(vload16(n, hits->u), n, results->barycentric + first);
    vstore16(vload16(n, hits->v), n, results->barycentric + params.result_capacity + first);
    vstore16(select((float16)(0.0f), offset + signed_t, found), n, results->distance + first);
    vstore16(convert_uchar16(select((int16)(KILN_STATUS_MISS), kind | multiple_hit_bits, found)), n, results->status + first);
  }
}

/// Writes the correspondence of ray i of a stream.
static inline void ray_stream_store_one(const stream_hits* hits, uint i, global const float* points, uint index,
                                        const kiln_ray_params params, const ray_stream_results* results) {
  ray_state ray;
  ray_hit hit;
  ray.offset =
      (params.flags & KILN_RAY_USE_REACH) != 0 ? points[6 * (size_t)params.capacity + index] : params.offset;
  ray.sign = (params.flags & KILN_RAY_INWARD) != 0 ? -1.0f : 1.0f;
  hit.triangle = hits->triangle[i];
  hit.t = hits->t[i];
  hit.u = hits->u[i];
  hit.v = hits->v[i];
  hit.multiple_hits = hits->multiple_hits[i];
  ray_store(index, params, &ray, &hit, results->triangle, results->barycentric, results->distance, results->status);
}

/// Casts `count` rays of one bin: samples first + order[0], ...; if there are 64, `is_run` says whether they are
/// consecutive samples. Rays of bin STREAM_BINS miss.
static KILN_CALL void ray_stream_cast(const kiln_ray_params params, global const kiln_bvh_node* nodes,
                                      global const kiln_bvh_block* blocks, global const float* points, uint bin,
                                      const ushort* order, uint first, uint count, bool is_run,
                                      const ray_stream_results* results) {
  ray_stream stream;
  stream_hits hits;
  for (uint n = 0; n < STREAM_VECTORS; ++n) {
    vstore16((float16)(params.t_min), n, hits.lo);
    vstore16((float16)(params.t_max), n, hits.hi);
    vstore16((uint16)(0xFFFFFFFFu), n, hits.key);
    vstore16((uint16)(KILN_NO_TRIANGLE), n, hits.triangle);
    vstore16((float16)(0.0f), n, hits.t);
    vstore16((float16)(0.0f), n, hits.u);
    vstore16((float16)(0.0f), n, hits.v);
    vstore16((uint16)(0), n, hits.multiple_hits);
  }
  if (bin != STREAM_BINS) {
    stream.hits = &hits;
    stream.order = ray_order(params);
    stream_open(bin, params, &stream);
    stream_load(points, first, order, count, is_run, params, &stream);
    if ((params.flags & KILN_RAY_LIMITED) != 0) {
      global const float* limits = points + 6 * (size_t)params.capacity + first;
      for (uint i = 0; i < count; ++i) hits.hi[i] = min(hits.hi[i], limits[order[i]]);
    }
    stream_trace(nodes, blocks, &stream, ~(ulong)0 >> (KILN_STREAM_RAYS - count));
  }
  if (is_run) {
    ray_stream_store(&hits, points, first + order[0], params, results);
  } else {
    for (uint i = 0; i < count; ++i) ray_stream_store_one(&hits, i, points, first + order[i], params, results);
  }
}

/// The bins of samples [first, first + 16), of which `count` exist; the others repeat the last one.
static inline int16 ray_stream_assign_bins(global const float* points, uint first, uint count, const kiln_ray_params params) {
  const size_t plane = params.capacity;
  global const float* sample = points + first;
  const bool use_reach = (params.flags & KILN_RAY_USE_REACH) != 0;
  float16 position[3], direction[3];
  float16 offset = (float16)(params.offset);
  if (count >= 16) {
    KILN_UNROLL
    for (int axis = 0; axis < 3; ++axis) {
      position[axis] = vload16(0, sample + axis * plane);
      direction[axis] = vload16(0, sample + (3 + axis) * plane);
    }
    if (use_reach) offset = vload16(0, sample + 6 * plane);
  } else {
    for (uint k = 0; k < 16; ++k) {
      const uint at = min(k, count - 1);
      for (int axis = 0; axis < 3; ++axis) {
        ((private float*)&position[axis])[k] = sample[axis * plane + at];
        ((private float*)&direction[axis])[k] = sample[(3 + axis) * plane + at];
      }
      if (use_reach) ((private float*)&offset)[k] = sample[6 * plane + at];
    }
  }
  return stream_bins(position, direction, offset, params);
}

/// Casts samples [first, first + count), at most KILN_RAY_STREAM_BLOCK.
static KILN_CALL void ray_stream_cast_block(const kiln_ray_params params, global const kiln_bvh_node* nodes,
                                            global const kiln_bvh_block* blocks, global const float* points, uint first,
                                            uint count, global uint* triangle, global float* barycentric,
                                            global float* distance, global uchar* status) {
  const ray_stream_results results = {triangle, barycentric, distance, status};
  ushort order[KILN_STREAM_RAYS];
  uchar bins[KILN_RAY_STREAM_BLOCK];
  ulong waiting[RAY_STREAM_RUNS];  // rays that are not part of a run, as bits
  for (uint run = 0; run < RAY_STREAM_RUNS; ++run) {
    waiting[run] = 0;
    const uint begin = run * KILN_STREAM_RAYS;
    if (begin >= count) continue;
    const uint rays = min(count - begin, (uint)KILN_STREAM_RAYS);
    int16 differ = (int16)(0);
    int bin = 0;
    for (uint n = 0; 16 * n < rays; ++n) {
      const int16 found = ray_stream_assign_bins(points, first + begin + 16 * n, rays - 16 * n, params);
      if (n == 0) bin = found.s0;
      differ |= found != (int16)(bin);
      vstore16(convert_uchar16(found), n, bins + begin);
    }
    if (rays == KILN_STREAM_RAYS && !mask_any16(differ)) {
      for (uint i = 0; i < KILN_STREAM_RAYS; ++i) order[i] = (ushort)(begin + i);
      ray_stream_cast(params, nodes, blocks, points, (uint)bin, order, first, rays, true, &results);
    } else {
      waiting[run] = ~(ulong)0 >> (KILN_STREAM_RAYS - rays);
    }
  }
  for (uint run = 0; run < RAY_STREAM_RUNS; ++run) {
    while (waiting[run] != 0) {
      // Selects the bin of the first waiting ray, and takes as many of its rays as fit into a stream.
      const uchar bin = bins[run * KILN_STREAM_RAYS + stream_lowest_bit(waiting[run])];
      uint rays = 0;
      for (uint other = run; other < RAY_STREAM_RUNS; ++other) {
        ulong binned_rays = 0;
        for (uint n = 0; n < STREAM_VECTORS; ++n) {
          const int16 ray_bins = convert_int16(vload16(n, bins + other * KILN_STREAM_RAYS));
          binned_rays |= (ulong)mask_bits16(ray_bins == (int16)(bin)) << (16 * n);
        }
        for (binned_rays &= waiting[other]; binned_rays != 0 && rays < KILN_STREAM_RAYS; binned_rays &= binned_rays - 1) {
          const uint ray = stream_lowest_bit(binned_rays);
          waiting[other] &= ~((ulong)1 << ray);
          order[rays++] = (ushort)(other * KILN_STREAM_RAYS + ray);
        }
      }
      ray_stream_cast(params, nodes, blocks, points, bin, order, first, rays, false, &results);
    }
  }
}

kernel void kiln_ray_closest_stream(
    const kiln_ray_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    global uint* restrict triangle,
    global float* restrict barycentric,
    global float* restrict distance,
    global uchar* restrict status) {
  const uint first = params.first + (uint)get_global_id(0) * KILN_RAY_STREAM_BLOCK;
  if (first >= params.end) return;
  const uint count = min(params.end - first, (uint)KILN_RAY_STREAM_BLOCK);
  ray_stream_cast_block(params, nodes, blocks, points, first, count, triangle, barycentric, distance, status);
}
