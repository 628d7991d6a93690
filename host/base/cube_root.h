// A cube root with the same result for every C library.
#pragma once

#include <cmath>

namespace kiln {

/// The cube root of a finite number above 0. It is rounded to nearest, except for one in thousands of arguments,
/// whose error is one unit in the last place. The results of std::cbrt() of glibc, MinGW-w64 and msvcrt differ for
/// half of all arguments, by up to 3 units. One step of Newton's method, whose residual is computed in twice the
/// precision, corrects the error of std::pow().
inline double cube_root(double x) {
  // Computes a * b - product exactly, from halves of 26 bits (Dekker 1971), since fma() of MinGW-w64 rounds
  // twice.
  const auto product_error = [](double a, double b, double product) {
    constexpr double kSplitter = (1 << 27) + 1;
    const double a_scaled = kSplitter * a, b_scaled = kSplitter * b;
    const double a_high = a_scaled - (a_scaled - a), b_high = b_scaled - (b_scaled - b);
    const double a_low = a - a_high, b_low = b - b_high;
    return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
  };
  const double root = std::pow(x, 1.0 / 3), square = root * root, cube = square * root;
  const double error = product_error(square, root, cube) + product_error(root, root, square) * root;
  return root + ((x - cube) - error) / (3 * square);
}

}  // namespace kiln
