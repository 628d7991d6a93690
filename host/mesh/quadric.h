// Quadric error: a sum of squared distances to planes.
#pragma once

#include <algorithm>
#include <cmath>

#include "mesh/vector.h"

namespace kiln {

/// Sum of squared distances to planes, each with a weight: symmetric matrix, vector, constant (Garland
/// and Heckbert 1997, "Surface Simplification Using Quadric Error Metrics", section 5).
struct Quadric {
  /// Weight of a pull to the middle of an edge, against that of all planes. Where normals differ by an angle, their
  /// planes hold a place across it by about its square: with 1e-3, vertices on shallow fillets were pulled off, and a
  /// little with 1e-6.
  static constexpr double kPull = 1e-9;

  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, x = 0, y = 0, z = 0, c = 0;
  double area = 0;  ///< Weight of the planes that the surface has; what rules add has none.

  /// \param normal  unit length
  void add_plane(const Vec3d& normal, const Vec3d& through, double weight);
  /// Adds weight * (gradient . p + offset)^2.
  void add_linear(const Vec3d& gradient, double offset, double weight);
  Quadric& operator+=(const Quadric& other);
  Quadric& operator*=(double weight);
  /// The sum at a point, at least 0.
  double at(const Vec3d& p) const;
  /// Root mean square of the distances from a point, times the weight of the surface's planes.
  double off(const Vec3d& p) const;
  /// Half of its gradient at a point.
  Vec3d slope(const Vec3d& p) const;
  /// Place where the sum is least, near the edge from a to b: with a slight pull to its middle, which decides
  /// where the planes leave a direction free. One of a, b and the middle where that is far off.
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

inline double Quadric::off(const Vec3d& p) const { return std::sqrt(at(p) * area); }

inline Vec3d Quadric::slope(const Vec3d& p) const {
  return {xx * p.x + xy * p.y + xz * p.z + x, xy * p.x + yy * p.y + yz * p.z + y,
          xz * p.x + yz * p.y + zz * p.z + z};
}

/// Additional weight of planes of a bent surface, for each unit of curvature.
/// A place is on the outline of a view as often as it is curved. A bent place that is off shows wrong normals.
/// The sum over all views of what outlines miss is the integral of distance times curvature. So flat places alone
/// weigh by area. Coordinates whose bounds have a diagonal of about 1.
inline constexpr double kCurvatureWeight = 0.3;
/// The same of hollows, against that: they are on no outline, but show normals.
inline constexpr double kHollowWeight = 0.5;

/// The planes of two triangles at an edge from a to b, for one of its ends. Their weight is the edge's length times
/// the angle between them. It does not depend on how finely a curved surface is cut into triangles.
/// \param c, d  third corners: the triangles are abc and bad
Quadric bent_planes(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

/// The plane that stands on an open border from a to b; none where that has no direction.
/// \param face  the triangle's normal, of any length
Quadric standing_plane(const Vec3d& a, const Vec3d& b, const Vec3d& face, double weight);

/// Planes of bent_planes() at an open border: it is on the outline of every view from which it is seen, as an edge that
/// turns back is. The triangle's plane holds it as much as the standing one.
Quadric border_planes(const Vec3d& a, const Vec3d& b, const Vec3d& face);

/// Weight of a line between two triangles beside what they hold, 0 to 1: a crease is held by its faces.
/// \param one, other  their normals, of any length
double line_share(const Vec3d& one, const Vec3d& other);

/// Largest weight of lines that are so long together, beside all edges, 0 to 1. Less where they are more than a
/// quarter, and not at all from a half on: where labels meet nearly everywhere, the shape comes first.
double room_for_lines(double length_of_lines, double length_of_edges);

/// The planes that stand on a line that is drawn on a surface, as of open borders.
/// \param one, other  normals of the two triangles, of any length
/// \param share       of the weight that an open border has
Quadric line_planes(const Vec3d& a, const Vec3d& b, const Vec3d& one, const Vec3d& other,
                    double share);

}  // namespace kiln
