#include "mesh/quadric.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln {
void Quadric::add_plane(const Vec3d& normal, const Vec3d& through, double weight) {
  add_linear(normal, -dot(normal, through), weight);
}

void Quadric::add_linear(const Vec3d& n, double d, double weight) {
  xx += weight * n.x * n.x, xy += weight * n.x * n.y, xz += weight * n.x * n.z;
  yy += weight * n.y * n.y, yz += weight * n.y * n.z, zz += weight * n.z * n.z;
  x += weight * n.x * d, y += weight * n.y * d, z += weight * n.z * d;
  c += weight * d * d;
}

Quadric& Quadric::operator*=(double weight) {
  for (double* const value : {&xx, &xy, &xz, &yy, &yz, &zz, &x, &y, &z, &c, &area})
    *value *= weight;
  return *this;
}

Vec3d Quadric::best_near(const Vec3d& pa, const Vec3d& pb) const {
  const Vec3d middle = (pa + pb) * 0.5;
  // Solves for the step from the middle of the edge. A weak attraction to the middle keeps the matrix regular.
  const double middle_weight = kMiddleWeight * (xx + yy + zz);
  const double m00 = xx + middle_weight, m11 = yy + middle_weight, m22 = zz + middle_weight;
  const Vec3d r = slope(middle) * -1.0;
  const Vec3d row0{m00, xy, xz}, row1{xy, m11, yz}, row2{xz, yz, m22};
  const Vec3d c12 = cross(row1, row2), c20 = cross(row2, row0), c01 = cross(row0, row1);
  const double determinant = dot(row0, c12);
  const Vec3d step = (c12 * r.x + c20 * r.y + c01 * r.z) * (1 / determinant);
  const Vec3d edge = pb - pa;
  if (dot(step, step) <= dot(edge, edge)) {  // The comparison is also false for NaN
    return middle + step;
  }
  const double at_a = at(pa), at_b = at(pb), at_middle = at(middle);
  if (at_middle <= at_a && at_middle <= at_b) return middle;
  return at_a <= at_b ? pa : pb;
}

Quadric bent_planes(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  const Vec3d n = cross(b - a, c - a), m = cross(a - b, d - b);
  const double size_n = length(n), size_m = length(m), edge = length(b - a);
  Quadric sum;
  if (!(size_n > 0) || !(size_m > 0)) return sum;
  const double angle = std::atan2(length(cross(n, m)), dot(n, m));
  const double share = dot(n, d - a) < 0 ? kCurvatureWeight : kCurvatureWeight * kConcaveWeight;
  // Each of the two triangles gets half of the weight, and each of the edge's two vertices half of that.
  const double weight = share * angle * edge / 4;
  sum.add_plane(n * (1 / size_n), a, weight);
  sum.add_plane(m * (1 / size_m), a, weight);
  sum.area = 2 * weight;
  return sum;
}

Quadric perpendicular_plane(const Vec3d& a, const Vec3d& b, const Vec3d& face, double weight) {
  Quadric sum;
  const Vec3d across = cross(b - a, face);
  const Vec3d normal = across * (1 / length(across));
  if (std::isfinite(normal.x + normal.y + normal.z)) sum.add_plane(normal, a, weight);
  return sum;
}

Quadric border_planes(const Vec3d& a, const Vec3d& b, const Vec3d& face) {
  // There is one triangle instead of two. Each of the edge's two vertices gets half of its weight.
  const double weight = kCurvatureWeight * std::numbers::pi * length(b - a) / 2;
  Quadric sum = perpendicular_plane(a, b, face, weight);
  const double size = length(face);
  if (!(size > 0)) return sum;
  sum.add_plane(face * (1 / size), a, weight);
  sum.area = 2 * weight;
  return sum;
}

double line_weight(const Vec3d& one, const Vec3d& other) {
  const double sizes = length(one) * length(other);
  return sizes > 0 ? std::max(0.0, dot(one, other) / sizes) : 0;
}

double max_line_weight(double length_of_lines, double length_of_edges) {
  constexpr double kFullHoldShare = 0.25, kNoHoldShare = 0.5;
  if (!(length_of_lines < kNoHoldShare * length_of_edges)) return 0;
  return std::min(
      1.0, (kNoHoldShare - length_of_lines / length_of_edges) / (kNoHoldShare - kFullHoldShare));
}

Quadric line_planes(const Vec3d& a, const Vec3d& b, const Vec3d& one, const Vec3d& other,
                    double share) {
  const double weight =
      share * line_weight(one, other) * kCurvatureWeight * std::numbers::pi * length(b - a) / 4;
  Quadric sum;
  for (const Vec3d& face : {one, other}) {
    const Quadric plane = perpendicular_plane(a, b, face, weight);
    sum += plane;
  }
  sum.area = 2 * weight;
  return sum;
}

}  // namespace kiln
