// Vertex colours of a simplified mesh.
#pragma once

#include "kiln/mesh.h"

namespace kiln {

/// Gives a simplified mesh vertex colours. Their interpolation is as near as possible to the high poly's colours, by
/// least squares in linear light. Each high-poly vertex is a sample at the nearest point of `low`, weighted by the area
/// around the vertex. The number of vertices used is at most 100,000, or 40 per vertex of `low` if that is more; they
/// are evenly spaced in the list of vertices. Does nothing if `high` has no colours.
///
/// Deterministic on any number of threads.
void transfer_colors(const Mesh& high, Mesh& low);

}  // namespace kiln
