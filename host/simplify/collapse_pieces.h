// A high poly brought near its goal piece by piece, on all threads.
#pragma once

#include <cstddef>
#include <span>

#include "simplify/collapse.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Collapses edges of a mesh down to about `faces`, piece by piece: as EdgeCollapser would, but where pieces meet. There
/// nothing moves, nor where labels meet. All pieces stop at the same cost, so that flat ones lose more. The pieces
/// depend on the mesh alone. Vertices that are left over go.
/// \param untouched  where nothing moves either
/// \param positions  the mesh's points
Work collapsed_in_pieces(const Work& dense, std::span<const Vec3> positions, std::size_t faces,
                         std::span<const Place> untouched, const EdgeCollapser::Snap& snap);

}  // namespace kiln
