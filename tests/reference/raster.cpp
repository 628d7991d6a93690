#include "reference/raster.h"

#include <array>
#include <cmath>

namespace kiln::test {
namespace {

using Integer = std::int64_t;

struct Point {
  Integer x = 0, y = 0;
  double depth = 0;
};

// Snapping is part of what is specified: single precision, in this order.
Point snap(const kiln_view& view, const Vec3& p) {
  const float right = (view.right[0] * p.x + view.right[1] * p.y) + view.right[2] * p.z;
  const float up = (view.up[0] * p.x + view.up[1] * p.y) + view.up[2] * p.z;
  const float x = right * view.scale + view.left;
  const float y = view.top - up * view.scale;
  const double near = double{view.toward[0]} * double{p.x} + double{view.toward[1]} * double{p.y} +
                      double{view.toward[2]} * double{p.z};
  return {std::llrint(double{x} * 256), std::llrint(double{y} * 256), 1 - near};
}

Integer cross(const Point& o, const Point& a, const Point& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

/// True if a centre that lies exactly on the edge from a to b belongs to the triangle on its right (rows
/// grow downwards): the edge is horizontal with the triangle below it, or leads upwards.
bool owns(const Point& a, const Point& b) { return (a.y == b.y && b.x > a.x) || b.y < a.y; }

}  // namespace

std::vector<ReferencePixel> reference_raster(const kiln_view& view, std::span<const Vec3> positions,
                                             std::span<const Triangle> triangles) {
  std::vector<ReferencePixel> pixels(std::size_t{view.width} * view.height);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    std::array<Point, 3> p;
    bool finite = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& v = positions[triangles[t][k]];
      finite = finite && std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
      if (finite) p[k] = snap(view, v);
    }
    if (!finite) continue;
    Integer area = cross(p[0], p[1], p[2]);
    const bool front = area < 0;
    if (area == 0 || (!front && (view.flags & KILN_RASTER_TWO_SIDED) == 0)) continue;
    if (front) {
      std::swap(p[1], p[2]);
      area = -area;
    }
    for (std::uint32_t y = 0; y < view.height; ++y) {
      for (std::uint32_t x = 0; x < view.width; ++x) {
        const Point centre{Integer{x} * 256 + 128, Integer{y} * 256 + 128, 0};
        std::array<Integer, 3> weight{};
        bool inside = true;
        for (std::size_t k = 0; k < 3; ++k) {
          const Point& a = p[(k + 1) % 3];
          const Point& b = p[(k + 2) % 3];
          weight[k] = cross(a, b, centre);
          inside = inside && (weight[k] > 0 || (weight[k] == 0 && owns(a, b)));
        }
        if (!inside) continue;
        double depth = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          depth += static_cast<double>(weight[k]) / static_cast<double>(area) * p[k].depth;
        }
        ReferencePixel& pixel = pixels[std::size_t{y} * view.width + x];
        if (pixel.triangle == KILN_NO_TRIANGLE) {
          pixel.triangle = t;
          pixel.depth = depth;
        } else if (depth < pixel.depth) {
          pixel.second = pixel.depth;
          pixel.triangle = t;
          pixel.depth = depth;
        } else if (depth < pixel.second) {
          pixel.second = depth;
        }
      }
    }
  }
  return pixels;
}

}  // namespace kiln::test
