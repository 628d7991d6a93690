// Charts: the connected pieces of a mesh's UV layout.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// For each triangle, the index of its chart. Charts are numbered from 0 in the order of their first triangles.
///
/// Triangles belong to one chart if a chain of shared edges connects them. An edge is shared if both of its ends have
/// equal positions and equal UVs. Meshes with vertices split at hard edges thus have the same charts as welded ones.
/// Charts that only touch in the layout remain separate, and so do triangles that share only one corner. Corners that
/// are not finite are equal only if their indices are.
///
/// Deterministic. About 0.5 s for a million triangles.
/// \param mesh  mesh with UVs, whose indices are in range
std::vector<std::uint32_t> uv_charts(const Mesh& mesh);

/// Charts of a subset of triangles, such as a texture set. The cost depends on the subset, not on the mesh.
/// \param triangles  indices in ascending order
/// \returns for each triangle of the mesh, the index of its chart; 0 for triangles that are not in the subset
std::vector<std::uint32_t> uv_charts(const Mesh& mesh, std::span<const std::uint32_t> triangles);

/// Area of a UV triangle; 0 if it is not finite. The unit square has area 1.
double uv_area(const Vec2& a, const Vec2& b, const Vec2& c);

/// Total area of the mesh's UV triangles.
double uv_area(const Mesh& mesh);

}  // namespace kiln
