// Vertex colours of a simplified mesh.
#pragma once

#include "kiln/mesh.h"

namespace kiln {

/// Gives a simplified mesh the vertex colours whose interpolation is nearest to the high poly's colours, by least
/// squares in linear light. Each high-poly vertex counts by the area around it, at the nearest point of `low`; at
/// most 100,000 vertices, or 40 per vertex of `low` if that is more, evenly spaced. Does nothing if `high` has no
/// colours.
///
/// Deterministic on any number of threads.
void transfer_colors(const Mesh& high, Mesh& low);

}  // namespace kiln
