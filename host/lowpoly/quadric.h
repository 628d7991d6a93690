// Quadric error: a sum of squared distances to planes.
#pragma once

#include "mesh/vector.h"

namespace kiln {

/// Sum of squared distances to planes, each with a weight: symmetric matrix, vector, constant (Garland
/// and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics", section 5).
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, x = 0, y = 0, z = 0, c = 0;
  double area = 0;  ///< Of the surface that the planes stand for; what rules add has none.

  /// \param normal  unit length
  void add_plane(const Vec3d& normal, const Vec3d& through, double weight);
  /// Adds weight * (gradient . p + offset)^2.
  void add_linear(const Vec3d& gradient, double offset, double weight);
  Quadric& operator+=(const Quadric& other);
  Quadric& operator*=(double weight);
  /// The sum at a point, at least 0.
  double at(const Vec3d& p) const;
  /// Where the sum is least, near the edge from a to b: with a slight pull to its middle, which decides
  /// where the planes leave a direction free. One of a, b and the middle where that is far off.
  Vec3d best_near(const Vec3d& a, const Vec3d& b) const;
};

}  // namespace kiln
