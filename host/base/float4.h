// Four floats in a register: GCC's and Clang's vector extension, SSE2 on any x86-64 and NEON on ARM.
#pragma once

#include <cstdint>
#include <cstring>

namespace kiln {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

inline Float4 splat(float value) { return Float4{value, value, value, value}; }
inline Float4 lower(Float4 a, Float4 b) { return a < b ? a : b; }
inline Float4 upper(Float4 a, Float4 b) { return a > b ? a : b; }

/// Four floats in a row, from any address.
inline Float4 load_float4(const float* from) {
  Float4 value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// The greatest whole numbers that are not above, for numbers within +-2^31.
inline Int4 floor_int4(Float4 value) {
  const Int4 whole = __builtin_convertvector(value, Int4);
  return whole + (__builtin_convertvector(whole, Float4) > value);  // true is -1
}

}  // namespace kiln
