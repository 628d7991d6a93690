// Removes, splits and adds triangles of a mesh, with all of their attributes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/box.h"
#include "mesh/vector.h"

namespace kiln {

/// One corner of a triangle.
struct CornerOf {
  std::uint32_t triangle, k;
};

/// A vertex that lies on an edge.
/// \param share  position along the edge, from 0 to 1
struct VertexOnEdge {
  std::uint32_t vertex;
  double share;
};

/// Removes triangles, and the vertices that only these used.
/// \param dropped  for each triangle, 1 if it is to be removed
void drop_triangles(Mesh& mesh, std::span<const std::uint8_t> dropped);

/// Adds a triangle of existing corners. It gets their UVs, normals and tangents, and the group, object and material of
/// the first corner's triangle.
void add_triangle(Mesh& mesh, const std::array<CornerOf, 3>& corners);

/// Splits a triangle along lines from points on its edge k to the opposite corner. UVs and normals are interpolated.
/// The first piece replaces the triangle; the others are appended.
void cut_triangle(Mesh& mesh, std::uint32_t t, std::uint32_t k,
                  std::span<const VertexOnEdge> points);

/// The sides (3 t + k) at edges that have a single triangle.
/// \param corners  triangles whose corners have equal indices for equal positions
std::vector<std::uint32_t> open_sides(std::span<const Triangle> corners, std::size_t vertices);

/// Adds the finite corners of a triangle to a box.
inline void add_triangle(Box<Vec3d>& box, const Mesh& mesh, const Triangle& t) {
  for (const std::uint32_t v : t) {
    if (is_finite(mesh.positions[v])) box.add(to_double(mesh.positions[v]));
  }
}

inline Vec3d point_of(const Mesh& mesh, std::uint32_t vertex) {
  return to_double(mesh.positions[vertex]);
}

/// A triangle's area; 0 if a corner is not finite.
inline double area_of(const Mesh& mesh, const Triangle& t) {
  const Vec3d a = point_of(mesh, t[0]);
  const double size = 0.5 * length(cross(point_of(mesh, t[1]) - a, point_of(mesh, t[2]) - a));
  return std::isfinite(size) ? size : 0;
}

}  // namespace kiln
