#include "reference/visibility.h"

#include <algorithm>
#include <cmath>

namespace kiln::reference {
namespace {

using Point = std::array<double, 3>;

double determinant(const Point& a, const Point& b, const Point& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

Point from(const Vec3& a, const Point& origin) {
  return {a.x - origin[0], a.y - origin[1], a.z - origin[2]};
}

enum class Meeting { misses, doubtful, hits };

/// By Cramer's rule: place + t d = (1 - u - v) a + u b + v c.
Meeting meet(const Point& a, const Point& b, const Point& c, const Point& d, double start,
             double end, double slack) {
  const Point ab = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  const Point ac = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  const Point back = {-d[0], -d[1], -d[2]};
  const Point to = {-a[0], -a[1], -a[2]};
  const double size = determinant(ab, ac, back);
  if (size == 0) return Meeting::misses;
  const double u = determinant(to, ac, back) / size;
  const double v = determinant(ab, to, back) / size;
  const double t = determinant(ab, ac, to) / size;
  const double inside = std::min(std::min(u, v), 1 - u - v);
  const double reached = std::min(t - start, end - t);
  if (inside < -slack || reached < -slack * start) return Meeting::misses;
  return inside > slack && reached > slack * start ? Meeting::hits : Meeting::doubtful;
}

}  // namespace

SeenSum see(std::span<const Vec3> positions, std::span<const Triangle> triangles,
            const Point& place, const Point& normal, std::span<const SeenDirection> directions,
            double least_cosine, double start, double end, double slack) {
  SeenSum result;
  for (const SeenDirection& direction : directions) {
    const Point& d = direction.toward;
    const double cosine = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2];
    const double share = cosine * direction.weight;
    if (cosine < least_cosine - 1e-6) continue;
    Meeting worst = cosine < least_cosine + 1e-6 ? Meeting::doubtful : Meeting::misses;
    for (const Triangle& t : triangles) {
      const Meeting meeting = meet(from(positions[t[0]], place), from(positions[t[1]], place),
                                   from(positions[t[2]], place), d, start, end, slack);
      if (meeting == Meeting::hits) worst = Meeting::hits;
      if (meeting == Meeting::doubtful && worst == Meeting::misses) worst = meeting;
    }
    if (worst == Meeting::doubtful) result.doubtful += share;
    if (worst == Meeting::hits) continue;
    for (std::size_t i = 0; i < 3; ++i) result.sum[i] += share * d[i];
    result.weight += share;
  }
  return result;
}

}  // namespace kiln::reference
