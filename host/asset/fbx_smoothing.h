// Smoothing groups and smooth edges of FBX meshes without normals.
#pragma once

#ifdef KILN_HAS_UFBX
#include <cstdint>
#include <string_view>
#include <vector>

#include "asset/fbx_library.h"

namespace kiln {

/// Smooth pieces of the surface around each vertex, by the edges' flags where a mesh has them, else by the faces' masks: at
/// a vertex, faces with a group in common have one normal, directly or through others, as in 3ds Max. Faces of no group are flat.
/// \param groups  mask per face; empty: none
/// \returns per corner, the least corner of its piece; empty: the mesh says nothing of it
std::vector<std::uint32_t> smooth_pieces(const ufbx_mesh& mesh,
                                         const std::vector<std::uint32_t>& groups);

/// The smoothing groups by face of a file's geometries, in its order: masks, of which ufbx keeps whether any bit is set. Empty
/// for geometries without. Reads text and little-endian binary; of a file that is damaged, as far as it is whole.
std::vector<std::vector<std::uint32_t>> fbx_smoothing_groups(std::string_view bytes);

}  // namespace kiln
#endif
