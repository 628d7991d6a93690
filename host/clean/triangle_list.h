// Triangles of a mesh left out, cut and added, with all that belongs to them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
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

/// Around points that are finite.
struct Box {
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  void add(const Vec3d& p) {
    if (!std::isfinite(p.x + p.y + p.z)) return;
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  /// 0 without any.
  double diagonal() const { return high.x < low.x ? 0 : length(high - low); }
};

inline Vec3d point_of(const Mesh& mesh, std::uint32_t vertex) {
  return Vec3d(mesh.positions[vertex]);
}

/// 0 where a corner is not finite.
inline double area_of(const Mesh& mesh, const Triangle& t) {
  const Vec3d a = point_of(mesh, t[0]);
  const double size = 0.5 * length(cross(point_of(mesh, t[1]) - a, point_of(mesh, t[2]) - a));
  return std::isfinite(size) ? size : 0;
}

}  // namespace kiln
