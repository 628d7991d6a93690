// Vertex colours of a simplified mesh.
#pragma once

#include "kiln/mesh.h"

namespace kiln {

/// Gives each vertex of a simplified mesh a colour, so that its triangles come nearest to the high poly's: by least
/// squares, in linear light. It counts vertices of the high poly with the area around them, each at the nearest
/// point of `low`. At most 100,000 of them, or 40 a vertex of `low`, evenly spaced. Nothing where `high` has no colours.
///
/// Deterministic on any number of threads.
void transfer_colors(const Mesh& high, Mesh& low);

}  // namespace kiln
