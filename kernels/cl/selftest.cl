// Self-test of a device: checks, to the bit, the operations that Kiln's kernels use.
//
// Tested are the operations of shared/selftest.h, on scalars and on vectors of 4, 8 and 16 lanes, and atomic
// operations. host/cl/selftest.cpp compares each word with its own result; then it casts rays through a tiny tree with
// the kernel that bakes use (accel/ray.cl), so that no other kernel must be compiled. Features that no kernel uses are
// not tested: local memory, barriers, images, half.
//
// | kernel                | global size         | local | traffic an item                    |
// | kiln_selftest_operate | KILN_SELFTEST_ITEMS | 64    | 20 B, writes 33 words              |
//
// Defines: KILN_SELFTEST_ATOMIC64  the device has 64-bit atomics
//          KILN_GPU                the device is a GPU
#include "lib/call.clh"
#include "lib/mask.clh"
#include "shared/selftest.h"

#ifdef KILN_SELFTEST_ATOMIC64
#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable
#pragma OPENCL EXTENSION cl_khr_int64_extended_atomics : enable
#endif

#define vload1(at, from) ((from)[at])
#define vstore1(value, at, to) ((to)[at] = (value))

// selftest_lanes_N: applies the operations to N inputs, beginning with input N * at. W is the suffix of type names: N,
// or empty for scalars.
#define SELFTEST_KEEP(N, operation, word) \
  vstore##N(word, at, out + (operation)*KILN_SELFTEST_ITEMS)
#define SELFTEST_DEFINE(N, W)                                                                      \
  static KILN_CALL void selftest_lanes_##N(global const kiln_selftest_input* in, uint at,          \
                                           global uint* out) {                                     \
    _Pragma("OPENCL FP_CONTRACT OFF");                                                             \
    const float##W a = vload##N(at, in->a), b = vload##N(at, in->b), c = vload##N(at, in->c);      \
    const int##W p = vload##N(at, in->p), q = vload##N(at, in->q);                                 \
    const uint##W u = as_uint##W(p), v = as_uint##W(q), shift = v & 31u;                           \
    SELFTEST_KEEP(N, KILN_SELFTEST_SUMS, as_uint##W((a * b + c) - b * c));                         \
    SELFTEST_KEEP(N, KILN_SELFTEST_FMA, as_uint##W(fma(a, b, c)));                                 \
    SELFTEST_KEEP(N, KILN_SELFTEST_DIVISION, as_uint##W(a / b - sqrt(fabs(c))));                   \
    const float##W near = clamp(max(min(a, b), c), -1.5f, 3.25f);                                  \
    SELFTEST_KEEP(N, KILN_SELFTEST_ROUNDING,                                                       \
                  as_uint##W(copysign(floor(a) + fabs(rint(b)) + near, c)));                       \
    const uint##W chosen = select(as_uint##W(a), as_uint##W(b), as_uint##W(p < q));                \
    SELFTEST_KEEP(N, KILN_SELFTEST_SELECT,                                                         \
                  select(chosen, as_uint##W(c), as_uint##W((a < c) & (p != q))));                  \
    const int##W small = convert_int##W(convert_short##W(p >> 16)) +                               \
                         convert_int##W(convert_uchar##W(u >> 24));                                \
    const float##W large = convert_float##W(p) + convert_float##W(u);                              \
    SELFTEST_KEEP(N, KILN_SELFTEST_CONVERT,                                                        \
                  as_uint##W(convert_int##W(a * 1000.0f) + small) ^ as_uint##W(large));            \
    SELFTEST_KEEP(N, KILN_SELFTEST_INTEGER,                                                        \
                  ((u * v + (u << shift)) ^ (v >> shift)) +                                        \
                      as_uint##W(min(p, q) >> as_int##W(shift)) +                                  \
                      (clz(u >> shift) + (popcount(u) << 8)));                                     \
    const long##W wide = convert_long##W(p) * convert_long##W(q) - (convert_long##W(q) << 20);     \
    const int##W high = convert_int##W(wide >> 32);                                                \
    SELFTEST_KEEP(N, KILN_SELFTEST_LONG,                                                           \
                  as_uint##W(convert_int##W(wide & 0x7fffffffL) ^ high) +                           \
                      select(u, v, as_uint##W(high >= 0)));                                        \
  }
SELFTEST_DEFINE(1, )
SELFTEST_DEFINE(4, 4)
SELFTEST_DEFINE(8, 8)
SELFTEST_DEFINE(16, 16)

/// Applies all operations to one input: scalar operations; vector operations if the input's index is also that of a
/// vector; masks and atomics.
static KILN_CALL void selftest_run_item(const uint item, global const kiln_selftest_input* in,
                                        volatile global uint* cells, volatile global ulong* least,
                                        global uint* out) {
  const uint width = KILN_SELFTEST_OPERATIONS * KILN_SELFTEST_ITEMS;
  selftest_lanes_1(in, item, out);
  if (item < KILN_SELFTEST_ITEMS / 4) selftest_lanes_4(in, item, out + width);
  if (item < KILN_SELFTEST_ITEMS / 8) selftest_lanes_8(in, item, out + 2 * width);
  if (item < KILN_SELFTEST_ITEMS / 16) selftest_lanes_16(in, item, out + 3 * width);
  const int16 is_less = vload16(item / 16, in->a) < vload16(item / 16, in->b);
  const int8 is_half_less = item % 16 < 8 ? is_less.lo : is_less.hi;
  const uint masks = mask_bits16(is_less) + (mask_bits8(is_half_less) << 16);
  out[KILN_SELFTEST_MASKS * KILN_SELFTEST_ITEMS + item] =
      masks + (mask_bits4(is_half_less.lo) << 24) + (mask_any8(is_half_less) ? 1u << 31 : 0u);

  const uint cell = item % KILN_SELFTEST_CELLS;
  const uint value = as_uint(in->p[item]);
  atomic_min(cells + cell, value);
  atomic_max(cells + KILN_SELFTEST_CELLS + cell, value);
  atomic_inc(cells + 2 * KILN_SELFTEST_CELLS + cell);
#ifdef KILN_SELFTEST_ATOMIC64
  atom_min(least + cell, (ulong)value << 32 | item);
#else
  (void)least;
#endif
}

kernel void kiln_selftest_operate(global const kiln_selftest_input* restrict in,
                                  volatile global uint* restrict cells,
                                  volatile global ulong* restrict least,
                                  global uint* restrict out) {
  const uint item = (uint)get_global_id(0);
  if (item < KILN_SELFTEST_ITEMS) selftest_run_item(item, in, cells, least, out);
}
