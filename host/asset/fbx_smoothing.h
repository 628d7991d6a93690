// Smoothing groups and smooth edges of FBX meshes without normals.
#pragma once

#ifdef KILN_HAS_UFBX
#include <cstdint>
#include <string_view>
#include <vector>

#include "asset/fbx_library.h"

namespace kiln {

/// Smooth pieces of the surface around each vertex, by edge flags if a mesh has them, else by the faces' masks: at a
/// vertex, faces with a common group share a normal, directly or transitively, as in 3ds Max. Faces without a group are
/// flat.
/// \param groups  mask per face; empty: none
/// \returns per corner, the lowest corner of its piece; empty if the mesh has neither flags nor groups
std::vector<std::uint32_t> smooth_pieces(const ufbx_mesh& mesh,
                                         const std::vector<std::uint32_t>& groups);

/// The smoothing groups of a file's geometries, per face, in file order: masks, of which ufbx only keeps whether any
/// bit is set. Empty for geometries without groups. Reads text and little-endian binary; damaged files up to the
/// damage.
std::vector<std::vector<std::uint32_t>> fbx_smoothing_groups(std::string_view bytes);

}  // namespace kiln
#endif
