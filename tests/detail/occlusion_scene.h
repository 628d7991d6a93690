// Meshes of known occlusion, and how they are baked.
#pragma once

#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "image/gutter.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln::test {

/// A low poly whose texels cover all of the map: a square in the plane z = 0.
inline Mesh ground(double side) { return plane(1, 1, side, side); }

/// Adds a flat face with its normal to a mesh, whose UVs are taken off.
inline void add_face(Mesh& mesh, std::span<const Vec3> corners, Vec3 normal) {
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const auto of_normal = static_cast<std::uint32_t>(mesh.normals.size());
  mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
  mesh.normals.push_back(normal);
  for (std::uint32_t i = 2; i < corners.size(); ++i) {
    mesh.triangles.push_back({first, first + i - 1, first + i});
    mesh.normal_triangles.push_back({of_normal, of_normal, of_normal});
  }
}

/// Looks along the cross product of both edges, which are along axes.
inline void add_rectangle(Mesh& mesh, Vec3 at, Vec3 a, Vec3 b) {
  const Vec3 corners[] = {at,
                          {at.x + a.x, at.y + a.y, at.z + a.z},
                          {at.x + a.x + b.x, at.y + a.y + b.y, at.z + a.z + b.z},
                          {at.x + b.x, at.y + b.y, at.z + b.z}};
  const Vec3 n{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  const float size = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  add_face(mesh, corners, {n.x / size, n.y / size, n.z / size});
}

/// Parallel to the plane z = 0: 256 corners.
inline void add_disc(Mesh& mesh, Vec3 centre, float radius, bool looks_up) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 256; ++i) {
    const double angle = 2 * std::numbers::pi * (looks_up ? i : 256 - i) / 256;
    corners.push_back({centre.x + radius * static_cast<float>(std::cos(angle)),
                       centre.y + radius * static_cast<float>(std::sin(angle)), centre.z});
  }
  add_face(mesh, corners, {0, 0, looks_up ? 1.0F : -1.0F});
}

inline BakeOptions asking(std::vector<MapKind> maps, std::uint32_t side) {
  BakeOptions options;
  options.width = options.height = side;
  options.encoding.gutter = 0;
  options.encoding.raw = true;
  options.maps = std::move(maps);
  options.match.max_distance = Length::absolute(0.1);
  return options;
}

inline const Image& map_of(const BakeResult& result, std::string_view name) {
  for (const BakedMap& map : result.maps) {
    if (map.kind.name == name) return map.image;
  }
  throw std::runtime_error("no such map");
}

}  // namespace kiln::test
