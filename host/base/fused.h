// A fused multiply-add that rounds once on every platform.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace kiln {

/// a * b + c, rounded once to the nearest float, as fma() of OpenCL and of IEEE 754. std::fma() is not always: that of
/// MinGW rounds the sum to a double first, and so differs in a third of all random triples. The product is exact in a
/// double (24 + 24 bits of 53); the sum is rounded to odd there (Boldo, Melquiond 2008), so that the second rounding
/// knows on which side of a tie it lies. Of numbers that are not finite, the NaN or infinity that the sum is.
inline float fused_multiply_add(float a, float b, float c) {
  const double product = double{a} * b, addend = c;
  double sum = product + addend;
  if (std::isfinite(sum)) {
    // Knuth's two-sum: what the rounding of the sum left out.
    const double part = sum - product;
    const double error = (product - (sum - part)) + (addend - part);
    const auto bits = std::bit_cast<std::uint64_t>(sum);
    if (error != 0 && (bits & 1U) == 0) {
      // Towards the exact sum, whose next double is odd: away from 0 where the error has the sum's sign.
      sum = std::bit_cast<double>((error > 0) == (sum > 0) ? bits + 1 : bits - 1);
    }
  }
  return static_cast<float>(sum);
}

}  // namespace kiln
