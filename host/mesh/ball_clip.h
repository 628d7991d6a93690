// Triangles clipped by a ball.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "mesh/vector.h"

namespace kiln {

/// Area and edge lengths of a triangle inside of a ball.
struct BallClip {
  double area = 0;
  /// For edge k, which starts at corner k, the share of its length that lies in the ball
  std::array<double, 3> edge_share{};
};

/// Clips a triangle by a ball around the origin. An edge is clipped to its part in the ball. The area is clipped by
/// the circle in which the ball cuts the triangle's plane, as a sum of triangles and sectors at the circle's centre.
inline BallClip clip_by_ball(const std::array<Vec3d, 3>& corners, double squared_radius) {
  BallClip clip;
  const Vec3d across = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double doubled_area = length(across);
  const Vec3d normal = doubled_area > 0 ? across * (1 / doubled_area) : Vec3d{};
  const double away = dot(normal, corners[0]);
  const double squared_circle_radius =
      squared_radius - away * away;  // Squared radius of the circle
  // Sums the sectors' angles by multiplying complex numbers, so that one atan2() suffices.
  double real = 1, imaginary = 0;
  const auto turn = [&](double cosine, double sine) {
    const double previous_real = real;
    real = previous_real * cosine - imaginary * sine;
    imaginary = previous_real * sine + imaginary * cosine;
  };
  double triangles = 0;
  bool centre_inside = true, lines_far = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d& p = corners[k];
    const Vec3d& q = corners[(k + 1) % 3];
    const Vec3d way = q - p;
    const double whole = dot(way, way), half = dot(p, way), start = dot(p, p);
    const double root = half * half - whole * (start - squared_radius);
    double begin = 1, end = 0;
    if (root > 0 && whole > 0) {
      const double reach = std::sqrt(root), scale = 1 / whole;
      begin = std::max(0.0, (-half - reach) * scale);
      end = std::min(1.0, (-half + reach) * scale);
    }
    if (end > begin) clip.edge_share[k] = end - begin;
    if (!(squared_circle_radius > 0)) continue;
    // Dot and cross products of points on the edge, relative to the circle's centre.
    const double in_plane = start - away * away, side = dot(normal, cross(p, way));
    centre_inside = centre_inside && side >= 0;
    lines_far = lines_far && side * side > 0.81 * squared_circle_radius * whole;
    if (end > begin) {
      triangles += side * (end - begin);
      if (begin > 0) turn(in_plane + begin * half, side * begin);
      if (end < 1) turn(in_plane + (1 + end) * half + end * whole, side * (1 - end));
    } else {
      turn(in_plane + half, side);
    }
  }
  if (!(squared_circle_radius > 0) || !(doubled_area > 0)) return clip;
  // The angle lies in [0, 2 pi], or below pi if the centre lies outside. Rounding must not change 0 to 2 pi, or 2 pi
  // to 0.
  double angle = std::atan2(imaginary, real);
  constexpr double kNone = 1e-9;
  if (centre_inside && std::abs(angle) < kNone) {
    angle = lines_far ? 2 * std::numbers::pi : 0;
  } else if (angle < (centre_inside ? 0 : -std::numbers::pi / 2)) {
    angle += 2 * std::numbers::pi;
  }
  clip.area = std::clamp((triangles + squared_circle_radius * angle) / 2, 0.0, doubled_area / 2);
  return clip;
}

}  // namespace kiln
