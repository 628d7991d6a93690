// Edge collapse in pieces of a mesh, on all threads.
#pragma once

#include <cstddef>
#include <span>

#include "simplify/collapse.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Collapses edges of a mesh down to about `faces`, as EdgeCollapser does, but in pieces on all threads. Vertices
/// where pieces or labels meet do not move. All pieces stop at the same cost, so that flat pieces lose more
/// triangles. The pieces depend on the mesh alone, not on the number of threads. Unused vertices are removed.
/// \param untouched  balls in which no vertex moves
/// \param positions  the mesh's vertex positions in single precision
Work collapse_in_pieces(const Work& dense, std::span<const Vec3> positions, std::size_t faces,
                        std::span<const Place> untouched, const EdgeCollapser::Snap& snap);

}  // namespace kiln
