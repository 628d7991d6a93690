// A fused multiply-add that rounds once on every platform.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace kiln {

/// a * b + c, rounded once to the nearest float, like fma() of OpenCL and IEEE 754. std::fma() of MinGW first rounds
/// the sum to a double, so its result differs for a third of random arguments. The product is exact in a double (24 +
/// 24 of 53 bits); the sum is rounded to odd in double precision (Boldo, Melquiond 2008), so that the second rounding
/// resolves ties correctly. If the sum is NaN or infinite, it is returned.
inline float fused_multiply_add(float a, float b, float c) {
  const double product = double{a} * b, addend = c;
  double sum = product + addend;
  if (std::isfinite(sum)) {
    // Knuth's two-sum: the rounding error of the sum.
    const double part = sum - product;
    const double error = (product - (sum - part)) + (addend - part);
    const auto bits = std::bit_cast<std::uint64_t>(sum);
    if (error != 0 && (bits & 1U) == 0) {
      // Rounds to odd: moves to the neighbouring double on the side of the exact sum, which is away from 0 if
      // the error has the sum's sign.
      sum = std::bit_cast<double>((error > 0) == (sum > 0) ? bits + 1 : bits - 1);
    }
  }
  return static_cast<float>(sum);
}

}  // namespace kiln
