// Checks the high poly's UVs.
#pragma once

#include "source/high_poly.h"

namespace kiln {

/// True if the mesh has UVs: as many index triples as triangles, all in range.
/// \throws Error(input) if it has invalid UVs
bool has_uvs(const Source::Impl& source);

}  // namespace kiln
