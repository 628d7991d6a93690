// Quadric errors: weighted sums of squared distances to planes.
#pragma once

#include <algorithm>
#include <cmath>

#include "mesh/vector.h"

namespace kiln {

/// A weighted sum of squared distances to planes, as a symmetric matrix, a vector and a constant (Garland and Heckbert
/// 1997, "Surface Simplification Using Quadric Error Metrics", section 5).
struct Quadric {
  /// Weight of the attraction to an edge's middle in best_near(), relative to the sum of all planes. Nearly parallel
  /// planes resist motion only in proportion to the squared angle between them: with 1e-3, vertices were pulled off
  /// shallow fillets, and slightly even with 1e-6.
  static constexpr double kMiddleWeight = 1e-9;

  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, x = 0, y = 0, z = 0, c = 0;
  /// Total weight of the surface's own planes, without planes of constraints
  double area = 0;

  /// \param normal  unit normal
  void add_plane(const Vec3d& normal, const Vec3d& through, double weight);
  /// Adds weight * (gradient . p + offset)^2.
  void add_linear(const Vec3d& gradient, double offset, double weight);
  Quadric& operator+=(const Quadric& other);
  Quadric& operator*=(double weight);
  /// Value of the sum at a point; at least 0.
  double at(const Vec3d& p) const;
  /// Root-mean-square distance of a point to the planes, times `area`.
  double weighted_distance(const Vec3d& p) const;
  /// Computes half of the sum's gradient at a point.
  Vec3d slope(const Vec3d& p) const;
  /// Position of the minimum near the edge from a to b. A weak attraction to the middle of the edge determines the
  /// directions in which the sum is constant. If the minimum is far away, the result is the best of a, b and the
  /// middle.
  Vec3d best_near(const Vec3d& a, const Vec3d& b) const;
};

inline Quadric& Quadric::operator+=(const Quadric& o) {
  xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
  x += o.x, y += o.y, z += o.z, c += o.c, area += o.area;
  return *this;
}

inline Quadric operator+(const Quadric& a, const Quadric& b) {
  return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz,    a.zz + b.zz,
          a.x + b.x,   a.y + b.y,   a.z + b.z,   a.c + b.c,   a.area + b.area};
}

inline double Quadric::at(const Vec3d& p) const {
  const double value = p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + x)) +
                       p.y * (yy * p.y + 2 * (yz * p.z + y)) + p.z * (zz * p.z + 2 * z) + c;
  return std::max(value, 0.0);
}

inline double Quadric::weighted_distance(const Vec3d& p) const { return std::sqrt(at(p) * area); }

inline Vec3d Quadric::slope(const Vec3d& p) const {
  return {xx * p.x + xy * p.y + xz * p.z + x, xy * p.x + yy * p.y + yz * p.z + y,
          xz * p.x + yz * p.y + zz * p.z + z};
}

/// Additional weight of planes per unit of curvature, for the sake of outlines. The share of all views in which a point
/// lies on the outline is proportional to its curvature, so the error of outlines over all views is the integral of
/// distance times curvature. Planes of flat surfaces get no additional weight. For coordinates with a diagonal of about
/// 1.
inline constexpr double kCurvatureWeight = 0.3;
/// Factor of kCurvatureWeight at concave edges, which form no outlines but affect normals.
inline constexpr double kConcaveWeight = 0.5;

/// The planes of the two triangles at an edge from a to b, as a quadric for one of the edge's vertices. The weight is
/// length times angle; its sum does not depend on how finely a curved surface is tessellated.
/// \param c, d  third corners: the triangles are abc and bad
Quadric bent_planes(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

/// The plane that contains an open border from a to b and stands perpendicular to the face. Empty if a and b coincide
/// or the normal is zero, which leaves no such plane.
/// \param face  the triangle's normal, of any length
Quadric perpendicular_plane(const Vec3d& a, const Vec3d& b, const Vec3d& face, double weight);

/// Variant of bent_planes() for an open border. A border lies on the outline in every view that shows it, like an edge
/// that is folded by 180 degrees. The triangle's plane and the perpendicular plane have equal weights.
Quadric border_planes(const Vec3d& a, const Vec3d& b, const Vec3d& face);

/// Weight of a line between two triangles, 0 to 1, relative to an open border. At a crease it is lower, since the faces
/// already hold the line.
/// \param one, other  normals of the two triangles, of any length
double line_weight(const Vec3d& one, const Vec3d& other);

/// Largest weight of lines, 0 to 1, for a given total length of lines. The weight decreases if lines are more than a
/// quarter of all edges, and is 0 if they are half of them. Where labels meet nearly everywhere, the shape has
/// priority.
double max_line_weight(double length_of_lines, double length_of_edges);

/// The planes that contain a line on the surface and stand perpendicular to its two triangles, as for open borders.
/// \param one, other  normals of the two triangles, of any length
/// \param share       weight relative to an open border
Quadric line_planes(const Vec3d& a, const Vec3d& b, const Vec3d& one, const Vec3d& other,
                    double share);

}  // namespace kiln
