// SIMD vectors of two or four numbers: the vector extension of GCC and Clang (SSE2 on any x86-64, NEON on ARM), or
// plain loops for other compilers and with KILN_PLAIN_VECTORS. Both give the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace kiln {

#if defined(__GNUC__) && !defined(KILN_PLAIN_VECTORS)

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Double2 = double __attribute__((vector_size(16)));
using Word2 = std::uint64_t __attribute__((vector_size(16)));

/// Selects lane by lane. \param mask  result of a comparison
template <typename Mask, typename T>
T select(Mask mask, T yes, T no) {
  return mask ? yes : no;
}
inline Float4 to_float4(Int4 value) { return __builtin_convertvector(value, Float4); }
/// Rounds toward 0.
inline Int4 to_int4(Float4 value) { return __builtin_convertvector(value, Int4); }

/// Prefetches memory into the cache.
inline void prefetch(const void* from) { __builtin_prefetch(from); }

#else

template <typename T, std::size_t N, typename Truth>
struct Lanes {
  T lane[N];
  T& operator[](std::size_t i) { return lane[i]; }
  const T& operator[](std::size_t i) const { return lane[i]; }
  template <typename Result, typename Function>
  static Result each(const Function& function) {
    Result result{};
    for (std::size_t i = 0; i < N; ++i) result[i] = function(i);
    return result;
  }
  static Lanes all(T value) {
    return each<Lanes>([&](std::size_t) { return value; });
  }
#define KILN_LANES(op, Result, expression)                               \
  friend Result operator op(const Lanes& a, const Lanes& b) {            \
    return each<Result>([&](std::size_t i) { return expression; });      \
  }                                                                      \
  friend Result operator op(const Lanes& a, T b) { return a op all(b); } \
  friend Result operator op(T a, const Lanes& b) { return all(a) op b; }
  using Mask = Lanes<Truth, N, Truth>;
  KILN_LANES(+, Lanes, static_cast<T>(a[i] + b[i]))
  KILN_LANES(-, Lanes, static_cast<T>(a[i] - b[i]))
  KILN_LANES(*, Lanes, static_cast<T>(a[i] * b[i]))
  KILN_LANES(/, Lanes, static_cast<T>(a[i] / b[i]))
  KILN_LANES(&, Lanes, static_cast<T>(a[i] & b[i]))
  KILN_LANES(|, Lanes, static_cast<T>(a[i] | b[i]))
  KILN_LANES(<, Mask, static_cast<Truth>(-(a[i] < b[i])))
  KILN_LANES(>, Mask, static_cast<Truth>(-(a[i] > b[i])))
  KILN_LANES(<=, Mask, static_cast<Truth>(-(a[i] <= b[i])))
  KILN_LANES(==, Mask, static_cast<Truth>(-(a[i] == b[i])))
#undef KILN_LANES
  friend Lanes operator-(const Lanes& a) {
    return each<Lanes>([&](std::size_t i) { return -a[i]; });
  }
  friend Lanes operator<<(const Lanes& a, int by) {
    return each<Lanes>([&](std::size_t i) { return a[i] << by; });
  }
  friend Lanes operator>>(const Lanes& a, int by) {
    return each<Lanes>([&](std::size_t i) { return a[i] >> by; });
  }
  Lanes& operator&=(const Lanes& other) { return *this = *this & other; }
  Lanes& operator+=(const Lanes& other) { return *this = *this + other; }
};

using Float4 = Lanes<float, 4, std::int32_t>;
using Int4 = Lanes<std::int32_t, 4, std::int32_t>;
using Double2 = Lanes<double, 2, std::int64_t>;
using Word2 = Lanes<std::uint64_t, 2, std::int64_t>;

template <typename Mask, typename T>
T select(const Mask& mask, const T& yes, const T& no) {
  return T::template each<T>([&](std::size_t i) { return mask[i] != 0 ? yes[i] : no[i]; });
}
inline Float4 to_float4(const Int4& value) {
  return Float4::each<Float4>([&](std::size_t i) { return static_cast<float>(value[i]); });
}
inline Int4 to_int4(const Float4& value) {
  // Values outside of the integer range become the smallest integer, as in SSE2.
  return Float4::each<Int4>([&](std::size_t i) {
    const bool fits = value[i] >= -2147483648.0F && value[i] < 2147483648.0F;
    return fits ? static_cast<std::int32_t>(value[i]) : INT32_MIN;
  });
}
inline void prefetch(const void*) {}

#endif

inline Float4 splat(float value) { return Float4{value, value, value, value}; }
inline Float4 lower(Float4 a, Float4 b) { return select(a < b, a, b); }
inline Float4 upper(Float4 a, Float4 b) { return select(a > b, a, b); }
inline Double2 larger(Double2 a, Double2 b) { return select(a < b, b, a); }

/// Loads four consecutive floats from an address with any alignment.
inline Float4 load_float4(const float* from) {
  Float4 value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// Rounds down, for numbers within +-2^31.
inline Int4 floor_int4(Float4 value) {
  const Int4 truncated = to_int4(value);
  return truncated + (to_float4(truncated) > value);  // a true lane is -1
}

}  // namespace kiln
