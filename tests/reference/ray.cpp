#include "reference/ray.h"

#include <cmath>

namespace kiln::reference {
namespace {

using Point = std::array<double, 3>;

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double inner(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace

RayHit cast_ray(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                const Point& origin, const Point& direction, const RaySearch& search) {
  RayHit best;
  const auto better = [&](double t) {
    if (!best.found) return true;
    if (search.greatest_first) return t > best.t;
    if (!search.nearest_outward_first) return t < best.t;
    const bool out = t >= 0;
    const bool best_out = best.t >= 0;
    return out != best_out ? out : std::abs(t) < std::abs(best.t);
  };
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    std::array<Point, 3> p;
    bool finite = true;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3& v = positions[triangles[i][corner]];
      p[corner] = {v.x, v.y, v.z};
      finite = finite && std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
    }
    if (!finite) continue;
    // Moeller and Trumbore 1997.
    const Point e1 = minus(p[1], p[0]);
    const Point e2 = minus(p[2], p[0]);
    const Point normal = cross(e1, e2);
    const double along = inner(normal, direction);
    if (along == 0) continue;
    if (search.keep * along < 0) continue;
    const Point h = cross(direction, e2);
    const double det = inner(e1, h);
    const Point s = minus(origin, p[0]);
    const double u = inner(s, h) / det;
    const Point q = cross(s, e1);
    const double v = inner(direction, q) / det;
    const double t = inner(e2, q) / det;
    if (u < -search.slack || v < -search.slack || u + v > 1 + search.slack) continue;
    if (t < search.t_min || t > search.t_max || !better(t)) continue;
    best = {true, i, t, u, v};
  }
  return best;
}

}  // namespace kiln::reference
