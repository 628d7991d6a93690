#include "match/surface_places.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "base/parallel.h"

namespace kiln {
namespace {

// Distance of a point from its corner, as a share of the corner's distance to the centroid
constexpr double kCornerInset = 0.01;
constexpr std::size_t kMaxPointRows = 512;  // maximum number of rows of points in one triangle

/// Twice the area of a triangle; 0 for unusable triangles.
double doubled_area(const LowSurface& surface, std::size_t t) {
  if (surface.usable[t] == 0) return 0;
  const auto& [a, b, c] = surface.triangles[t];
  return length(cross(to_double(b.position) - to_double(a.position),
                      to_double(c.position) - to_double(a.position)));
}

/// Appends the centroids of a triangle's n x n parts, then points near its corners.
void add_triangle_points(std::uint32_t t, std::size_t n, std::vector<LowPolyPoint>& points) {
  const auto add = [&](double u, double v) {
    points.push_back({t, static_cast<float>(u), static_cast<float>(v)});
  };
  const auto size = static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; i + j < n; ++j) {
      const auto x = static_cast<double>(i), y = static_cast<double>(j);
      add((x + 1.0 / 3) / size, (y + 1.0 / 3) / size);
      if (i + j + 1 < n) add((x + 2.0 / 3) / size, (y + 2.0 / 3) / size);
    }
  }
  const double middle = kCornerInset / 3, corner = 1 - 2 * middle;
  add(middle, middle);
  add(corner, middle);
  add(middle, corner);
}

}  // namespace

Vec3d position_at(const LowSurface& surface, const LowPolyPoint& point) {
  const auto& [a, b, c] = surface.triangles[point.triangle];
  const double u = point.u, v = point.v;
  return to_double(a.position) * (1 - u - v) + to_double(b.position) * u +
         to_double(c.position) * v;
}

TexelBand band_of_points(cl::Context& context, const LowSurface& surface, std::size_t count,
                         const std::function<LowPolyPoint(std::size_t)>& point,
                         std::uint32_t multiple) {
  TexelBand band;
  band.row_count = 1;
  band.texel_count = band.sample_count = static_cast<std::uint32_t>(count);
  band.capacity = (band.sample_count + multiple - 1) / multiple * multiple;
  if (count == 0) return band;
  const std::size_t plane = band.capacity;
  std::vector<std::uint32_t> index(plane), first(plane + 1), slot(plane), triangle(plane);
  std::vector<float> weights(2 * plane), points(7 * plane);
  parallel_for(count, 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const LowPolyPoint at = point(i);
      const auto& [a, b, c] = surface.triangles[at.triangle];
      const double u = at.u, v = at.v, w = 1 - u - v;
      Vec3d direction =
          to_double(a.direction) * w + to_double(b.direction) * u + to_double(c.direction) * v;
      double reach = length(direction);
      if (!(reach > 1e-15)) {
        reach = 0;
        direction = cross(to_double(b.position) - to_double(a.position),
                          to_double(c.position) - to_double(a.position));
      }
      const Vec3 p = to_float(position_at(surface, at));
      const Vec3 d = to_float(direction * (1 / length(direction)));
      const float values[7] = {p.x, p.y, p.z, d.x, d.y, d.z, static_cast<float>(reach)};
      for (std::size_t k = 0; k < 7; ++k) points[k * plane + i] = values[k];
      index[i] = first[i] = static_cast<std::uint32_t>(i);
      triangle[i] = at.triangle;
      weights[i] = at.u;
      weights[plane + i] = at.v;
    }
  });
  first[count] = band.sample_count;
  const auto upload = [&]<typename T>(const std::vector<T>& values) {
    return cl::Array<T>(context, std::span<const T>(values));
  };
  band.texel_index = upload(index);
  band.texel_first = upload(first);
  band.sample_slot = upload(slot);
  band.triangle = upload(triangle);
  band.barycentric = upload(weights);
  band.points = upload(points);
  return band;
}

SampledPoints spread_points(cl::Context& context, const LowSurface& surface,
                            std::size_t target_count) {
  const std::size_t triangles = surface.triangles.size();
  double total_area = 0;
  for (std::size_t t = 0; t < triangles; ++t) total_area += doubled_area(surface, t);
  SampledPoints points;
  for (std::size_t t = 0; t < triangles; ++t) {
    const double area = doubled_area(surface, t);
    if (!(area > 0)) continue;
    const double share = area / total_area * static_cast<double>(target_count);
    const auto rows = static_cast<std::size_t>(std::lround(std::sqrt(share)));
    add_triangle_points(static_cast<std::uint32_t>(t),
                        std::clamp<std::size_t>(rows, 1, kMaxPointRows), points.list);
  }
  points.band = band_of_points(context, surface, points.list.size(),
                               [&](std::size_t i) { return points.list[i]; });
  return points;
}

}  // namespace kiln
