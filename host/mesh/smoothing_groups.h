// Hard edges as files tell them by smoothing groups, where they have no normals.
#pragma once

#include <cstdint>
#include <span>

#include "kiln/mesh.h"
#include "mesh/normals.h"

namespace kiln {

/// A triangle of no smoothing group: its polygon is flat.
inline constexpr std::uint32_t kFlatGroup = 0xFFFFFFFFU;

/// Normals that are smooth within each group and apart between groups, angle-weighted as vertex_normals(). Vertices
/// at one place count as one.
/// \param groups  per triangle of the mesh; kFlatGroup: none
CornerNormals group_normals(const Mesh& mesh, std::span<const std::uint32_t> groups);

/// Gives a mesh normals by smoothing groups as 3DS and FBX have them, several to a triangle: they part at edges whose
/// faces share none. See give_fan_normals().
/// \param masks  a bit a group, per triangle; 0: its polygon is flat
void give_group_normals(Mesh& mesh, std::span<const std::uint32_t> masks);

}  // namespace kiln
