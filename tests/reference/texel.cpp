#include "reference/texel.h"

#include <algorithm>
#include <cmath>

namespace kiln::test {
namespace {

// 128 bits hold any product here; the extension needs no -Wpedantic warning.
__extension__ using Wide = __int128;

struct Point {
  Wide x, y;
};

int sign(Wide value) { return (value > 0) - (value < 0); }

/// Which side of the line a -> b the point lies on, after the infinitesimal move right and down.
int side(const Point& a, const Point& b, const Point& p) {
  const Wide dx = b.x - a.x;
  const Wide dy = b.y - a.y;
  const int exact = sign(dx * (p.y - a.y) - dy * (p.x - a.x));
  if (exact != 0) return exact;
  const int moved_right = sign(-dy);
  return moved_right != 0 ? moved_right : sign(dx);
}

}  // namespace

std::vector<ReferenceSample> reference_samples(const std::vector<ReferenceTriangle>& triangles,
                                               int width, int height, int samples) {
  const int columns = width * samples;
  const int rows = height * samples;
  int bits = 28;
  while ((std::int64_t{1} << (28 - bits)) < std::max(columns, rows)) --bits;
  const long double scale = std::ldexp(1.0L, bits);

  std::vector<ReferenceSample> result(static_cast<std::size_t>(columns) *
                                      static_cast<std::size_t>(rows));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    Point corner[3];
    for (int k = 0; k < 3; ++k) {
      const ReferenceUv& uv = triangles[t][static_cast<std::size_t>(k)];
      const long double x = std::nearbyint(static_cast<long double>(uv.u) * columns * scale);
      const long double y = std::nearbyint(static_cast<long double>(uv.v) * rows * scale);
      corner[k].x = static_cast<std::int64_t>(x);
      corner[k].y = static_cast<std::int64_t>(rows * scale) - static_cast<std::int64_t>(y);
    }
    const Wide area = (corner[1].x - corner[0].x) * (corner[2].y - corner[0].y) -
                      (corner[1].y - corner[0].y) * (corner[2].x - corner[0].x);
    if (area == 0) continue;
    const int inside = sign(area);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const auto half = static_cast<std::int64_t>(scale / 2);
        const Point p{Wide{column} * 2 * half + half, Wide{row} * 2 * half + half};
        bool covered = true;
        for (int k = 0; k < 3 && covered; ++k) {
          covered = side(corner[k], corner[(k + 1) % 3], p) == inside;
        }
        if (!covered) continue;
        ReferenceSample& sample =
            result[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(column)];
        if (sample.covering++ != 0) continue;
        sample.triangle = static_cast<std::int64_t>(t);
        const auto weight = [&](const Point& a, const Point& b) {
          const Wide part = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
          return static_cast<double>(static_cast<long double>(part) /
                                     static_cast<long double>(area));
        };
        sample.u = weight(corner[2], corner[0]);
        sample.v = weight(corner[0], corner[1]);
      }
    }
  }
  return result;
}

}  // namespace kiln::test
