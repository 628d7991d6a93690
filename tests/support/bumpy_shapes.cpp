// Generates shapes with exact normals: the bumpy sphere and the bumpy torus.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "support/shape_parts.h"
#include "support/shapes.h"

namespace kiln::test {
namespace {

using namespace shape_parts;

/// A closed sphere of directions in 2n + 1 rings, ring i of 4 min(i, 2n - i) points and each pole of
/// one. z = 1 - (i/n)^2 makes all zones of the octant's triangles equal in area (the concentric map of
/// Shirley and Chiu 1997, seen from the pole), so triangles are even in size.
struct OctahedralGrid {
  std::uint32_t n;

  std::uint32_t rings() const { return 2 * n + 1; }
  std::uint32_t points(std::uint32_t ring) const {
    return std::max(1u, 4 * std::min(ring, 2 * n - ring));
  }
  std::uint32_t vertices() const { return 4 * n * n + 2; }
  std::uint32_t triangles() const { return 8 * n * n; }
  std::uint32_t first_vertex(std::uint32_t ring) const {
    if (ring == 0) return 0;
    if (ring <= n) return 1 + 2 * ring * (ring - 1);
    const std::uint32_t left = 2 * n - ring + 1;  // number of rings from here to the pole
    return vertices() - 1 - 2 * left * (left - 1);
  }
  /// Index of the first triangle in the band between `ring` and the next one. A band has 4 (2i + 1) triangles, where i
  /// is the lesser of the two rings' numbers.
  std::uint32_t first_triangle(std::uint32_t ring) const {
    if (ring <= n) return 4 * ring * ring;
    return triangles() - 4 * (2 * n - ring) * (2 * n - ring);
  }

  Vec3d direction(std::uint32_t ring, std::uint32_t k) const {
    const std::uint32_t step = std::min(ring, 2 * n - ring);
    const double t = static_cast<double>(step) / n;
    const double height = ring <= n ? 1 - t * t : t * t - 1;
    // equals sqrt(1 - height^2), but without cancellation
    const double flat = t * std::sqrt(2 - t * t);
    const double angle = step == 0 ? 0 : 2 * pi * k / (4.0 * step);
    return {flat * std::cos(angle), height, -flat * std::sin(angle)};
  }

  /// Writes the triangles of the band after `ring` to out[first_triangle(ring)...].
  void write_band(std::uint32_t ring, std::vector<Triangle>& out) const {
    std::uint32_t at = first_triangle(ring);
    const bool upper = ring < n;
    const std::uint32_t small_ring = upper ? ring : ring + 1;
    const std::uint32_t large_ring = upper ? ring + 1 : ring;
    const std::uint32_t small = points(small_ring), large = points(large_ring);
    const std::uint32_t small_base = first_vertex(small_ring);
    const std::uint32_t large_base = first_vertex(large_ring);
    const std::uint32_t step =
        large / 4;  // steps per quadrant of the larger ring; the smaller ring has one step less
    for (std::uint32_t quadrant = 0; quadrant < 4; ++quadrant) {
      for (std::uint32_t j = 0; j < step; ++j) {
        const std::uint32_t inner = small_base + (quadrant * (step - 1) + j) % small;
        const std::uint32_t outer = large_base + quadrant * step + j;
        const std::uint32_t outer_next = large_base + (quadrant * step + j + 1) % large;
        out[at++] = upper ? Triangle{inner, outer, outer_next} : Triangle{inner, outer_next, outer};
        if (j + 1 == step) continue;
        const std::uint32_t inner_next = small_base + (quadrant * (step - 1) + j + 1) % small;
        out[at++] = upper ? Triangle{inner, outer_next, inner_next}
                          : Triangle{inner, inner_next, outer_next};
      }
    }
  }
};

struct Wave {
  double amplitude;
  Vec3d k{};
  double phase;
};
constexpr std::array<Wave, 3> sphere_waves = {
    Wave{0.020, {7, 3, -2}, 0.3}, Wave{0.012, {-4, 9, 5}, 1.1}, Wave{0.008, {6, -8, 11}, 2.0}};

/// Unit vector of the torus in the direction of the growing angle around the axis.
Vec3d torus_along(double u) { return {-std::sin(u), 0, -std::cos(u)}; }

}  // namespace

double BumpySphere::radius(const Vec3d& direction) {
  double r = 1;
  for (const Wave& w : sphere_waves) r += w.amplitude * std::sin(dot(w.k, direction) + w.phase);
  return r;
}

// The surface is the zero set of f(p) = |p| - r(p / |p|), whose gradient on the surface is
// d - (g - (g . d) d) / r with d the direction and g the gradient of r as a function of space.
Vec3d BumpySphere::exact_normal(const Vec3d& point) {
  const Vec3d d = unit(point);
  Vec3d g{};
  for (const Wave& w : sphere_waves) {
    g = g + (w.amplitude * std::cos(dot(w.k, d) + w.phase)) * w.k;
  }
  return unit(d - (1 / radius(d)) * (g - dot(g, d) * d));
}

Mesh BumpySphere::dense(std::uint64_t faces, bool with_normals) {
  const double side = std::round(std::sqrt(static_cast<double>(faces) / 8));
  const OctahedralGrid grid{static_cast<std::uint32_t>(std::max(1.0, side))};
  Mesh mesh;
  mesh.name = "bumpy_sphere";
  mesh.positions.resize(grid.vertices());
  mesh.normals.resize(with_normals ? grid.vertices() : 0);
  mesh.triangles.resize(grid.triangles());
  parallel_for(grid.rings(), 16, [&](std::size_t begin, std::size_t end) {
    for (auto ring = static_cast<std::uint32_t>(begin); ring < end; ++ring) {
      for (std::uint32_t k = 0; k < grid.points(ring); ++k) {
        const Vec3d direction = grid.direction(ring, k);
        const std::uint32_t vertex = grid.first_vertex(ring) + k;
        mesh.positions[vertex] = to_float(radius(direction) * direction);
        if (with_normals) mesh.normals[vertex] = to_float(exact_normal(direction));
      }
      if (ring + 1 < grid.rings()) grid.write_band(ring, mesh.triangles);
    }
  });
  if (with_normals) mesh.normal_triangles = mesh.triangles;
  return mesh;
}

Mesh BumpySphere::light(std::uint32_t slices, std::uint32_t stacks) {
  return uv_sphere(slices, stacks);
}

double BumpyTorus::height(double u, double v) {
  return 0.015 * std::sin(9 * u) * std::cos(3 * v) + 0.010 * std::sin(14 * u + 4 * v);
}

// S(u, v) = R e(u) + (r + h) n(u, v); the normal is the cross product of the two partial derivatives.
Vec3d BumpyTorus::exact_normal(const Vec3d& point) {
  const double u = std::atan2(-point.z, point.x);
  const double v = std::atan2(point.y, std::hypot(point.x, point.z) - kMajorRadius);
  const double h_u = 0.135 * std::cos(9 * u) * std::cos(3 * v) + 0.140 * std::cos(14 * u + 4 * v);
  const double h_v = -0.045 * std::sin(9 * u) * std::sin(3 * v) + 0.040 * std::cos(14 * u + 4 * v);
  const double tube = kMinorRadius + height(u, v);
  const Vec3d n = torus_normal(u, v);
  const Vec3d n_v = -std::sin(v) * torus_outward(u) + Vec3d{0, std::cos(v), 0};
  const Vec3d s_u = (kMajorRadius + tube * std::cos(v)) * torus_along(u) + h_u * n;
  const Vec3d s_v = tube * n_v + h_v * n;
  return unit(cross(s_u, s_v));
}

Mesh BumpyTorus::dense(std::uint64_t faces, bool with_normals) {
  const double side = std::round(std::sqrt(static_cast<double>(faces) / 6));
  const auto rings = static_cast<std::uint32_t>(std::max(3.0, side));
  const std::uint32_t slices = 3 * rings;
  Mesh mesh;
  mesh.name = "bumpy_torus";
  mesh.positions.resize(std::size_t{slices} * rings);
  mesh.normals.resize(with_normals ? mesh.positions.size() : 0);
  parallel_for(rings, 16, [&](std::size_t begin, std::size_t end) {
    for (auto j = static_cast<std::uint32_t>(begin); j < end; ++j) {
      for (std::uint32_t i = 0; i < slices; ++i) {
        const double u = 2 * pi * i / slices, v = 2 * pi * j / rings;
        const Vec3d point =
            kMajorRadius * torus_outward(u) + (kMinorRadius + height(u, v)) * torus_normal(u, v);
        mesh.positions[cell(i, j, slices)] = to_float(point);
        if (with_normals) mesh.normals[cell(i, j, slices)] = to_float(exact_normal(point));
      }
    }
  });
  write_torus_triangles(slices, rings, mesh);
  if (with_normals) mesh.normal_triangles = mesh.triangles;
  return mesh;
}

Mesh BumpyTorus::light(std::uint32_t slices, std::uint32_t rings) {
  return torus(slices, rings, kMajorRadius, kMinorRadius);
}

}  // namespace kiln::test
