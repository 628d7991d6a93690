// Low-discrepancy points on a triangle.
#pragma once

#include <cmath>

namespace kiln {

/// Returns the fractional part of a number.
inline double fraction_of(double x) { return x - std::floor(x); }

/// A point of an infinite, evenly distributed sequence of points on a triangle, from the plastic number (Roberts 2018).
/// Its barycentric coordinates are 1 - u - v, u and v.
struct TriangleSpread {
  double u, v;
  /// \param i                 index in the sequence
  /// \param begin_u, begin_v  offset of the sequence
  explicit TriangleSpread(double i, double begin_u = 0, double begin_v = 0)
      : u(fraction_of(0.5 + 0.7548776662466927 * i + begin_u)),
        v(fraction_of(0.5 + 0.5698402909980532 * i + begin_v)) {
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
  }
};

}  // namespace kiln
