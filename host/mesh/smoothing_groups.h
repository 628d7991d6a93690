// Computes normals from smoothing groups, for files without normals.
#pragma once

#include <cstdint>
#include <span>

#include "kiln/mesh.h"
#include "mesh/normals.h"

namespace kiln {

/// Group of the triangles that have no smoothing group. Their polygons are flat.
inline constexpr std::uint32_t kFlatGroup = 0xFFFFFFFFU;

/// Normals that are smooth within each group and split between groups. They are weighted by angle, as vertex_normals()
/// are. Vertices of equal position count as one.
/// \param groups  group of each triangle; kFlatGroup: none
CornerNormals group_normals(const Mesh& mesh, std::span<const std::uint32_t> groups);

/// Computes normals from smoothing groups as in 3DS and FBX, where a triangle may belong to several: normals are split
/// at edges whose two faces have no group in common. See give_fan_normals().
/// \param masks  for each triangle, one bit per group; 0 if the polygon is flat
void give_group_normals(Mesh& mesh, std::span<const std::uint32_t> masks);

}  // namespace kiln
