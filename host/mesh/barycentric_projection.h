// Projects a point onto a triangle, in barycentric coordinates.
#pragma once

#include <algorithm>
#include <array>

#include "mesh/vector.h"

namespace kiln {

/// Barycentric coordinates of a point's projection onto the triangle's plane. If the projection lies outside of the
/// triangle, it is clamped to an edge.
inline std::array<double, 3> barycentric_projection(const Vec3d& p, const Vec3d& a, const Vec3d& b,
                                                    const Vec3d& c) {
  const Vec3d normal = cross(b - a, c - a);
  const double area = dot(normal, normal);
  if (!(area > 0)) return {1.0 / 3, 1.0 / 3, 1.0 / 3};
  std::array<double, 3> barycentric = {0, dot(cross(p - a, c - a), normal) / area,
                                       dot(cross(b - a, p - a), normal) / area};
  barycentric[0] = 1 - barycentric[1] - barycentric[2];
  double sum = 0;
  for (double& s : barycentric) sum += s = std::max(s, 0.0);
  for (double& s : barycentric) s /= sum;
  return barycentric;
}

}  // namespace kiln
