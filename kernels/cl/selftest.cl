// Self-test of a device: does it compute, to the bit, what Kiln's kernels need?
//
// Every work-item makes inputs by hashing its index, applies the operations of shared/selftest.h to 16 of them, as
// scalars and as vectors of 4, 8 and 16, and folds the bits of an operation's results into a word. Then it casts a
// ray through a tiny tree with both traversals, and takes part in atomic operations. host/cl/selftest.cpp compares
// each word with its own. What no kernel of Kiln's uses is not here: local memory, barriers, images, half.
//
// | kernel        | global size         | local | writes an item                |
// | kiln_selftest | KILN_SELFTEST_ITEMS | 64    | KILN_SELFTEST_RESULTS words   |
//
// Defines: KILN_SELFTEST_ATOMIC64  the device has 64-bit atomics
//          KILN_BVH_PLAIN          the tree has no guards (accel/prism.clh)
#include "accel/traverse_scalar.clh"
#include "accel/traverse_wide.clh"
#include "lib/hash.clh"
#include "shared/selftest.h"

#ifdef KILN_SELFTEST_ATOMIC64
#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable
#pragma OPENCL EXTENSION cl_khr_int64_extended_atomics : enable
#endif

typedef struct {
  int p[KILN_SELFTEST_LANES], q[KILN_SELFTEST_LANES];
  float a[KILN_SELFTEST_LANES], b[KILN_SELFTEST_LANES], c[KILN_SELFTEST_LANES];
} selftest_inputs;

typedef uint selftest_words[KILN_SELFTEST_OPERATIONS][KILN_SELFTEST_LANES];

// selftest_lanes_N: the operations on N inputs from `at` on. W is N in names of types, empty for scalars.
#define vload1(at, from) ((from)[at])
#define vstore1(value, at, to) ((to)[at] = (value))
#define SELFTEST_DEFINE(N, W)                                                                      \
  static void selftest_lanes_##N(const selftest_inputs* in, int at, selftest_words words) {        \
    _Pragma("OPENCL FP_CONTRACT OFF");                                                             \
    typedef float##W F;                                                                            \
    typedef int##W I;                                                                              \
    typedef uint##W U;                                                                             \
    typedef long##W L;                                                                             \
    const F a = vload##N(0, in->a + at), b = vload##N(0, in->b + at), c = vload##N(0, in->c + at); \
    const I p = vload##N(0, in->p + at), q = vload##N(0, in->q + at);                              \
    const U u = as_uint##W(p), shift = as_uint##W(q) & 31u;                                        \
    vstore##N(as_uint##W((a * b + c) - b * c), 0, words[KILN_SELFTEST_SUMS] + at);                 \
    vstore##N(as_uint##W(fma(a, b, c)), 0, words[KILN_SELFTEST_FMA] + at);                         \
    vstore##N(as_uint##W(a / b - sqrt(fabs(c))), 0, words[KILN_SELFTEST_DIVISION] + at);           \
    const F near = clamp(max(min(a, b), c), -1.5f, 3.25f);                                         \
    vstore##N(as_uint##W(copysign(floor(a) + fabs(rint(b)) + near, c)), 0,                         \
              words[KILN_SELFTEST_ROUNDING] + at);                                                 \
    const U chosen = select(as_uint##W(a), as_uint##W(b), as_uint##W(p < q));                      \
    vstore##N(select(chosen, as_uint##W(c), as_uint##W((a < c) & (p != q))), 0,                    \
              words[KILN_SELFTEST_SELECT] + at);                                                   \
    const I small = convert_int##W(convert_short##W(p >> 16)) +                                    \
                    convert_int##W(convert_uchar##W(u >> 24));                                     \
    const F large = convert_float##W(p) + convert_float##W(u);                                     \
    vstore##N(as_uint##W(convert_int##W(a * 1000.0f) + small) ^ as_uint##W(large), 0,              \
              words[KILN_SELFTEST_CONVERT] + at);                                                  \
    const U bits = (u * as_uint##W(q) + (u << shift)) ^ (as_uint##W(q) >> shift);                  \
    const U counts = clz(u >> shift) + (popcount(u) << 8);                                         \
    vstore##N(bits + as_uint##W(min(p, q) >> as_int##W(shift)) + counts, 0,                        \
              words[KILN_SELFTEST_INTEGER] + at);                                                  \
    const L wide = convert_long##W(p) * convert_long##W(q) - (convert_long##W(q) << 20);           \
    const I sign = select(p, q, convert_int##W(wide >> 32) >= 0);                                  \
    vstore##N(as_uint##W(convert_int##W(wide) ^ convert_int##W(wide >> 32)) + as_uint##W(sign), 0, \
              words[KILN_SELFTEST_LONG] + at);                                                     \
  }
SELFTEST_DEFINE(1, )
SELFTEST_DEFINE(4, 4)
SELFTEST_DEFINE(8, 8)
SELFTEST_DEFINE(16, 16)

static uint selftest_fold(uint word, uint value) { return hash_of(word ^ value); }

static void selftest_keep(selftest_words words, uint width, global uint* results) {
  for (uint o = 0; o < KILN_SELFTEST_OPERATIONS; ++o) {
    uint word = 0;
    for (uint k = 0; k < KILN_SELFTEST_LANES; ++k) word = selftest_fold(word, words[o][k]);
    results[(width * KILN_SELFTEST_OPERATIONS + o) * KILN_SELFTEST_ITEMS] = word;
  }
}

kernel void kiln_selftest(
    const kiln_ray_params params,
    global const kiln_bvh_node* restrict nodes,
    global const kiln_bvh_block* restrict blocks,
    global const float* restrict points,
    volatile global uint* restrict cells,  // zeros, the words of a least value all ones
    volatile global ulong* restrict least,  // all ones
    global uint* restrict results) {
  const uint item = (uint)get_global_id(0);
  if (item >= KILN_SELFTEST_ITEMS) return;
  results += item;
  selftest_inputs in;
  for (uint k = 0; k < KILN_SELFTEST_LANES; ++k) {
    const uint first = (item * KILN_SELFTEST_LANES + k) * 5u;
    in.p[k] = as_int(hash_of(first));
    in.q[k] = as_int(hash_of(first + 1u));
    in.a[k] = (float)as_int(hash_of(first + 2u)) * 0x1p-28f;
    in.b[k] = (float)as_int(hash_of(first + 3u)) * 0x1p-28f;
    in.c[k] = (float)as_int(hash_of(first + 4u)) * 0x1p-28f;
  }
  selftest_words words;
  for (int k = 0; k < KILN_SELFTEST_LANES; ++k) selftest_lanes_1(&in, k, words);
  selftest_keep(words, 0u, results);
  for (int k = 0; k < KILN_SELFTEST_LANES; k += 4) selftest_lanes_4(&in, k, words);
  selftest_keep(words, 1u, results);
  for (int k = 0; k < KILN_SELFTEST_LANES; k += 8) selftest_lanes_8(&in, k, words);
  selftest_keep(words, 2u, results);
  selftest_lanes_16(&in, 0, words);
  selftest_keep(words, 3u, results);

  const int16 less = vload16(0, in.a) < vload16(0, in.b);
  const int8 half_any = less.lo & less.hi;
  uint masks = mask_bits16(less);
  masks = selftest_fold(masks, mask_bits8(less.lo) | mask_bits8(less.hi) << 8);
  masks = selftest_fold(masks, mask_bits4(less.hi.lo) << 1 | (mask_any8(half_any) ? 1u : 0u));
  results[KILN_SELFTEST_MASKS * KILN_SELFTEST_ITEMS] = masks;

  ray_state ray;
  for (uint wide = 0; wide < 2; ++wide) {
    ray_hit hit;
    ray_start(points, item, params, &hit);
    if (ray_load(points, item, params, &ray)) {
      if (wide != 0) {
        wide_trace(nodes, blocks, &ray, ray_order(params), false, &hit);
      } else {
        scalar_trace(nodes, blocks, &ray, ray_order(params), false, &hit);
      }
    }
    results[(KILN_SELFTEST_HIT + 2 * wide) * KILN_SELFTEST_ITEMS] = hit.triangle;
    results[(KILN_SELFTEST_WHERE + 2 * wide) * KILN_SELFTEST_ITEMS] = selftest_fold(
        selftest_fold(selftest_fold(0u, as_uint(hit.t)), as_uint(hit.u)), as_uint(hit.v));
  }

  const uint cell = item % KILN_SELFTEST_CELLS;
  const uint value = as_uint(in.p[0]);
  atomic_min(cells + cell, value);
  atomic_max(cells + KILN_SELFTEST_CELLS + cell, value);
  atomic_inc(cells + 2 * KILN_SELFTEST_CELLS + cell);
#ifdef KILN_SELFTEST_ATOMIC64
  atom_min(least + cell, (ulong)value << 32 | item);
#else
  (void)least;
#endif
}
