// Building blocks of generated shapes: vectors in double precision, grids, tori.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "base/parallel.h"
#include "support/shapes.h"

namespace kiln::test::shape_parts {

inline constexpr double pi = std::numbers::pi;

inline Vec3d operator+(const Vec3d& a, const Vec3d& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3d operator-(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3d operator*(double s, const Vec3d& a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vec3d unit(const Vec3d& a) { return (1 / std::sqrt(dot(a, a))) * a; }
inline Vec3 to_float(const Vec3d& a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}
inline Vec2 to_float(double u, double v) { return {static_cast<float>(u), static_cast<float>(v)}; }

/// Row-major index of a cell in a grid with `width` columns.
inline std::uint32_t cell(std::uint32_t x, std::uint32_t y, std::uint32_t width) {
  return y * width + x;
}

/// Unit vector from the torus's axis outward, at the angle u around the axis.
inline Vec3d torus_outward(double u) { return {std::cos(u), 0, -std::sin(u)}; }

inline Vec3d torus_normal(double u, double v) {
  return std::cos(v) * torus_outward(u) + Vec3d{0, std::sin(v), 0};
}

inline void write_torus_triangles(std::uint32_t slices, std::uint32_t rings, Mesh& mesh) {
  mesh.triangles.resize(std::size_t{2} * slices * rings);
  parallel_for(rings, 64, [&](std::size_t begin, std::size_t end) {
    for (auto j = static_cast<std::uint32_t>(begin); j < end; ++j) {
      const std::uint32_t next_j = (j + 1) % rings;
      for (std::uint32_t i = 0; i < slices; ++i) {
        const std::uint32_t next_i = (i + 1) % slices;
        const std::uint32_t a = cell(i, j, slices), b = cell(next_i, j, slices);
        const std::uint32_t c = cell(next_i, next_j, slices), d = cell(i, next_j, slices);
        mesh.triangles[std::size_t{2} * a] = {a, b, c};
        mesh.triangles[std::size_t{2} * a + 1] = {a, c, d};
      }
    }
  });
}

}  // namespace kiln::test::shape_parts
