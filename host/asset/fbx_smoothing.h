// Finds the smooth pieces of FBX meshes without normals, from smoothing groups and edge flags.
#pragma once

#ifdef KILN_HAS_UFBX
#include <cstdint>
#include <string_view>
#include <vector>

#include "asset/fbx_library.h"

namespace kiln {

/// Finds the smooth pieces of the surface around each vertex: by edge flags if the mesh has them,
/// otherwise by the smoothing groups of the faces. At a vertex, faces with a common group share a
/// normal, directly or transitively, as in 3ds Max. Faces without a group are flat.
/// \param groups  mask per face; empty: none
/// \returns for each corner, the lowest corner of its piece; empty if the mesh has neither flags nor groups
std::vector<std::uint32_t> smooth_pieces(const ufbx_mesh& mesh,
                                         const std::vector<std::uint32_t>& groups);

/// Reads the smoothing groups of all geometries, in the order of the file, as a mask per face.
/// (ufbx only stores whether any bit is set.) Geometries without groups get an empty list. Reads
/// text and little-endian binary files; a damaged file is read up to the damage.
std::vector<std::vector<std::uint32_t>> fbx_smoothing_groups(std::string_view bytes);

}  // namespace kiln
#endif
