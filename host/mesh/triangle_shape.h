// Squared side lengths and area of a triangle.
#pragma once

#include "kiln/types.h"

namespace kiln {

/// Squared side lengths and area of a triangle, in double precision.
struct TriangleShape {
  double squared_edge[3] = {0, 0, 0};  ///< Squared length of the edge opposite corner k
  double area = 0;                     ///< Area; 0 if a corner is not finite
};
TriangleShape triangle_shape(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace kiln
