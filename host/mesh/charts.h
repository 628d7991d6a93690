// Charts: the connected pieces of a mesh's UV layout.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Returns each triangle's chart, numbered from 0 in the order of their first triangles.
///
/// Triangles belong to one chart if a chain of shared edges connects them. An edge is shared if both of its ends have
/// equal positions and equal UVs. Meshes with split vertices (at hard edges) thus give the same charts as welded
/// ones. Charts that only touch in the layout remain separate, and so do triangles that share a single corner.
/// Corners that are not finite are equal only if their indices are.
///
/// Deterministic. About 0.5 s for a million triangles.
/// \param mesh  mesh with UVs, whose indices are in range
std::vector<std::uint32_t> uv_charts(const Mesh& mesh);

/// uv_charts() of a subset of triangles, such as a texture set. The cost depends on the subset, not on the mesh.
/// \param triangles  indices, ascending \returns each triangle's chart, for the mesh's triangles; 0 for all others
std::vector<std::uint32_t> uv_charts(const Mesh& mesh, std::span<const std::uint32_t> triangles);

/// Area of a triangle of UVs; 0 if it is not finite. The unit square has area 1.
double uv_area(const Vec2& a, const Vec2& b, const Vec2& c);

/// Total area of the mesh's UV triangles.
double uv_area(const Mesh& mesh);

}  // namespace kiln
