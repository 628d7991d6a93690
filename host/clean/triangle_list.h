// Triangles of a mesh left out, cut and added, with all that belongs to them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"
#include "mesh/vector.h"

namespace kiln {

/// A corner of a triangle.
struct CornerOf {
  std::uint32_t triangle, k;
};

/// A vertex on an edge. \param share  of the way along the edge
struct OnEdge {
  std::uint32_t vertex;
  double share;
};

/// Leaves out triangles, and vertices that only these had.
/// \param dropped  by triangle
void drop_triangles(Mesh& mesh, std::span<const std::uint8_t> dropped);

/// Adds a triangle of corners that others have, with their UVs, normals and tangents; it is of the group, object and
/// material of the first.
void add_triangle(Mesh& mesh, const std::array<CornerOf, 3>& corners);

/// Cuts a triangle along lines from vertices of its edge k to the corner opposite. UVs and normals are interpolated. The
/// first piece takes its place, the others are added.
void cut_triangle(Mesh& mesh, std::uint32_t t, std::uint32_t k, std::span<const OnEdge> points);

/// Sides of triangles, 3 t + k, of edges that no other triangle has. \param corners  equal where positions are
std::vector<std::uint32_t> open_sides(std::span<const Triangle> corners, std::size_t vertices);

inline Vec3d point_of(const Mesh& mesh, std::uint32_t vertex) {
  return Vec3d(mesh.positions[vertex]);
}

}  // namespace kiln
