// Edges and triangles clipped by a ball.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "mesh/vector.h"

namespace kiln {

/// Which part of the way from a to b lies in a ball around 0: [first, second], nothing where second
/// < first.
inline std::pair<double, double> part_within(const Vec3d& a, const Vec3d& b,
                                             double squared_radius) {
  const Vec3d way = b - a;
  const double squared = dot(way, way), half = dot(a, way);
  const double root = half * half - squared * (dot(a, a) - squared_radius);
  if (!(root > 0) || !(squared > 0)) return {1, 0};
  const double reach = std::sqrt(root);
  return {std::max(0.0, (-half - reach) / squared), std::min(1.0, (-half + reach) / squared)};
}

/// Area of a triangle's part in a ball around 0: of the circle that the ball cuts out of its plane,
/// by sectors and triangles from the circle's centre.
inline double area_within(const std::array<Vec3d, 3>& corners, double squared_radius) {
  const Vec3d across = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const Vec3d normal = across * (1 / length(across));
  const Vec3d centre = normal * dot(normal, corners[0]);
  const double squared = squared_radius - dot(centre, centre);
  if (!(squared > 0)) return 0;
  const auto triangle = [&](const Vec3d& p, const Vec3d& q) { return dot(normal, cross(p, q)); };
  const auto sector = [&](const Vec3d& p, const Vec3d& q) {
    return squared * std::atan2(triangle(p, q), dot(p, q));
  };
  double doubled = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d p = corners[k] - centre, q = corners[(k + 1) % 3] - centre;
    const auto [begin, end] = part_within(p, q, squared);
    if (end <= begin) {
      doubled += sector(p, q);
      continue;
    }
    const Vec3d in = p + (q - p) * begin, out = p + (q - p) * end;
    if (begin > 0) doubled += sector(p, in);
    doubled += triangle(in, out);
    if (end < 1) doubled += sector(out, q);
  }
  return std::max(0.0, doubled / 2);
}

}  // namespace kiln
