// Places on a triangle, evenly spread.
#pragma once

#include <cmath>

namespace kiln {

/// A number without its whole part.
inline double fraction_of(double x) { return x - std::floor(x); }

/// One of endlessly many places on a triangle, even however many there are: the sequence that follows from the
/// plastic number (Roberts 2018). Its weights are 1 - u - v, u and v.
struct TriangleSpread {
  double u, v;
  /// \param i                 which
  /// \param begin_u, begin_v  begins elsewhere
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
