// Checks the invariants of meshes that readers return.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "kiln/mesh.h"

namespace kiln::test {

/// The first invariant of kiln/mesh.h that the mesh violates; empty if it violates none.
inline std::string broken_promise(const Mesh& mesh) {
  const auto in_range = [](const std::vector<Triangle>& list, std::size_t pool) {
    for (const Triangle& triangle : list) {
      for (const std::uint32_t index : triangle) {
        if (index >= pool) return false;
      }
    }
    return true;
  };
  const std::size_t n = mesh.triangles.size();
  if (n == 0) return "no triangles";
  if (!in_range(mesh.triangles, mesh.positions.size())) return "vertex index out of range";
  if (!in_range(mesh.uv_triangles, mesh.uvs.size())) return "UV index out of range";
  if (!in_range(mesh.normal_triangles, mesh.normals.size())) return "normal index out of range";
  if (!mesh.uv_triangles.empty() && mesh.uv_triangles.size() != n)
    return "UVs: not one index triple per triangle";
  if (mesh.uv_triangles.empty() != mesh.uvs.empty())
    return "UVs without indices, or indices without UVs";
  if (!mesh.normal_triangles.empty() && mesh.normal_triangles.size() != n)
    return "normals: not one index triple per triangle";
  if (mesh.normal_triangles.empty() != mesh.normals.empty())
    return "normals without indices, or indices without normals";
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.positions.size())
    return "colors: not one per vertex";
  const auto named = [n](const std::vector<std::uint32_t>& of,
                         const std::vector<std::string>& names) {
    return (of.empty() || of.size() == n) &&
           std::all_of(of.begin(), of.end(),
                       [&](std::uint32_t name) { return name < names.size(); });
  };
  if (!named(mesh.groups, mesh.group_names)) return "groups: wrong count, or an index out of range";
  if (!named(mesh.objects, mesh.object_names))
    return "objects: wrong count, or an index out of range";
  if (!named(mesh.materials, mesh.material_names))
    return "materials: wrong count, or an index out of range";
  for (const double value : mesh.origin) {
    if (!std::isfinite(value)) return "origin not finite";
  }
  for (const Vec3& v : mesh.normals) {
    const double length = std::sqrt(double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z);
    if (length != 0 && !(std::abs(length - 1) < 1e-6)) return "normal neither unit nor zero";
  }
  return {};
}

}  // namespace kiln::test
