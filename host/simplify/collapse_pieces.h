// Edge collapse of a mesh in pieces, on all threads.
#pragma once

#include <cstddef>
#include <span>

#include "simplify/collapse.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Collapses edges of a mesh down to about `faces` triangles, as EdgeCollapser does, but in pieces on all threads.
/// Vertices at which pieces or labels meet do not move. All pieces stop at the same cost, so flat pieces lose more
/// triangles than curved ones. The pieces depend on the mesh alone, not on the number of threads. Unused vertices are
/// removed.
/// \param untouched  balls in which no vertex moves
/// \param positions  the mesh's vertex positions in single precision
Work collapse_in_pieces(const Work& dense, std::span<const Vec3> positions, std::size_t faces,
                        std::span<const Ball> untouched, const EdgeCollapser::Snap& snap);

}  // namespace kiln
