#include "match/surface_places.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "base/parallel.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr double kInset = 0.01;         // of the way from a corner to the middle
constexpr std::size_t kMostRows = 512;  // of places in one triangle

/// Twice the area; 0 where it does not count.
double area_of(const LowSurface& surface, std::size_t t) {
  if (surface.usable[t] == 0) return 0;
  const auto& [a, b, c] = surface.triangles[t];
  return length(
      cross(Vec3d(b.position) - Vec3d(a.position), Vec3d(c.position) - Vec3d(a.position)));
}

/// The middles of a triangle's n x n parts, then its corners.
void add_places(std::uint32_t t, std::size_t n, SurfacePlaces& places) {
  const auto add = [&](double u, double v) {
    places.triangle.push_back(t);
    places.u.push_back(static_cast<float>(u));
    places.v.push_back(static_cast<float>(v));
  };
  const auto size = static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; i + j < n; ++j) {
      const auto x = static_cast<double>(i), y = static_cast<double>(j);
      add((x + 1.0 / 3) / size, (y + 1.0 / 3) / size);
      if (i + j + 1 < n) add((x + 2.0 / 3) / size, (y + 2.0 / 3) / size);
    }
  }
  const double middle = kInset / 3, corner = 1 - 2 * middle;
  add(middle, middle);
  add(corner, middle);
  add(middle, corner);
}

/// Seven planes of the places' points.
std::vector<float> points_of(const LowSurface& surface, const SurfacePlaces& places) {
  const std::size_t count = places.size();
  std::vector<float> points(7 * count, 0.0F);
  parallel_for(count, 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& [a, b, c] = surface.triangles[places.triangle[i]];
      const double u = places.u[i], v = places.v[i], w = 1 - u - v;
      const Vec3 p =
          to_float(Vec3d(a.position) * w + Vec3d(b.position) * u + Vec3d(c.position) * v);
      Vec3d d = Vec3d(a.direction) * w + Vec3d(b.direction) * u + Vec3d(c.direction) * v;
      if (!(length(d) > 1e-15)) {
        d = cross(Vec3d(b.position) - Vec3d(a.position), Vec3d(c.position) - Vec3d(a.position));
      }
      const Vec3 unit = to_float(d * (1 / length(d)));
      const float values[6] = {p.x, p.y, p.z, unit.x, unit.y, unit.z};
      for (std::size_t k = 0; k < 6; ++k) points[k * count + i] = values[k];
    }
  });
  return points;
}

}  // namespace

SurfacePlaces spread_places(cl::Context& context, const LowSurface& surface, std::size_t wanted) {
  const std::size_t triangles = surface.triangles.size();
  double whole = 0;
  for (std::size_t t = 0; t < triangles; ++t) whole += area_of(surface, t);
  SurfacePlaces places;
  for (std::size_t t = 0; t < triangles; ++t) {
    const double area = area_of(surface, t);
    if (!(area > 0)) continue;
    const double share = area / whole * static_cast<double>(wanted);
    const auto rows = static_cast<std::size_t>(std::lround(std::sqrt(share)));
    add_places(static_cast<std::uint32_t>(t), std::clamp<std::size_t>(rows, 1, kMostRows), places);
  }
  std::vector<float> weights = places.u;
  weights.insert(weights.end(), places.v.begin(), places.v.end());
  const std::vector<float> points = points_of(surface, places);
  TexelBand& band = places.band;
  band.sample_count = band.capacity = static_cast<std::uint32_t>(places.size());
  band.triangle =
      cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(places.triangle));
  band.barycentric = cl::Array<float>(context, std::span<const float>(weights));
  band.points = cl::Array<float>(context, std::span<const float>(points));
  return places;
}

}  // namespace kiln
