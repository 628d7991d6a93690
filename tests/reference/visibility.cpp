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

std::vector<SeenSum> see_around_vertices(std::span<const Vec3> positions,
                                         std::span<const Triangle> triangles,
                                         std::span<const SeenDirection> directions, int places,
                                         double least_cosine, double start, double end) {
  std::vector<SeenSum> result(positions.size());
  for (const Triangle& t : triangles) {
    const Point a = from(positions[t[0]], {0, 0, 0});
    const Point ab = from(positions[t[1]], a);
    const Point ac = from(positions[t[2]], a);
    Point normal = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2],
                    ab[0] * ac[1] - ab[1] * ac[0]};
    const double area = std::hypot(normal[0], normal[1], normal[2]);
    for (double& n : normal) n /= area;
    for (int k = 0; k < places * places; ++k) {
      // Even over the triangle: the distance from its first corner as the root of an even number.
      const double away = std::sqrt((k / places + 0.5) / places);
      const double along = (k % places + 0.5) / places;
      const std::array<double, 3> share = {1 - away, away * (1 - along), away * along};
      Point place;
      for (std::size_t i = 0; i < 3; ++i) place[i] = a[i] + share[1] * ab[i] + share[2] * ac[i];
      const SeenSum seen =
          see(positions, triangles, place, normal, directions, least_cosine, start, end, 0);
      for (std::size_t corner = 0; corner < 3; ++corner) {
        SeenSum& sum = result[t[corner]];
        for (std::size_t i = 0; i < 3; ++i) sum.sum[i] += area * share[corner] * seen.sum[i];
        sum.weight += area * share[corner] * seen.weight;
      }
    }
  }
  return result;
}

}  // namespace kiln::reference
