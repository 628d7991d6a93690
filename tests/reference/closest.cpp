#include "reference/closest.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kiln::reference {
namespace {

using Point = std::array<double, 3>;

Point at(const Vec3& v) { return {v.x, v.y, v.z}; }
Point along(const Point& a, double s, const Point& b) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
double inner(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Point& a) { return std::sqrt(inner(a, a)); }
Point outer(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double segment_distance(const Point& p, const Point& a, const Point& b) {
  const Point edge = along(b, -1, a);
  const Point to = along(p, -1, a);
  const double s = std::clamp(inner(to, edge) / inner(edge, edge), 0.0, 1.0);
  return length(along(to, -s, edge));
}

}  // namespace

TriangleShape triangle_shape(std::span<const Vec3> positions, const Triangle& triangle) {
  const Point a = at(positions[triangle[0]]);
  const Point b = at(positions[triangle[1]]);
  const Point c = at(positions[triangle[2]]);
  TriangleShape shape;
  shape.normal = outer(along(b, -1, a), along(c, -1, a));
  shape.longest =
      std::max({length(along(b, -1, a)), length(along(c, -1, b)), length(along(a, -1, c))});
  shape.height = length(shape.normal) / shape.longest;
  return shape;
}

double triangle_distance(std::span<const Vec3> positions, const Triangle& triangle,
                         const Point& point) {
  const std::array<Point, 3> p{at(positions[triangle[0]]), at(positions[triangle[1]]),
                               at(positions[triangle[2]])};
  // Within the prism over the triangle, the distance to the plane; else to the nearest edge.
  const Point normal = outer(along(p[1], -1, p[0]), along(p[2], -1, p[0]));
  bool within = true;
  double edges = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Point& from = p[k];
    const Point& to = p[(k + 1) % 3];
    const Point inward = outer(normal, along(to, -1, from));
    within = within && inner(inward, along(point, -1, from)) >= 0;
    edges = std::min(edges, segment_distance(point, from, to));
  }
  if (!within) return edges;
  return std::abs(inner(normal, along(point, -1, p[0]))) / length(normal);
}

ClosestHit closest_point(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                         const Point& point, const Point& direction, const ClosestSearch& search) {
  ClosestHit best;
  best.distance = search.max_distance;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const TriangleShape shape = triangle_shape(positions, triangles[i]);
    if (!search.two_sided &&
        inner(shape.normal, direction) < search.least_facing * shape.longest * shape.longest) {
      continue;
    }
    const double distance = triangle_distance(positions, triangles[i], point);
    if (distance < best.distance || (!best.found && distance <= best.distance)) {
      best = {true, i, distance};
    }
  }
  return best;
}

}  // namespace kiln::reference
