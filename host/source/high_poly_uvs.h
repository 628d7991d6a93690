// True if the high poly's UVs can be used.
#pragma once

#include "source/high_poly.h"

namespace kiln {

/// True if the mesh has UVs, then as many triples as triangles, with indices that are good.
/// \throws Error(input) where it has some, but not so
bool has_uvs(const Source::Impl& source);

}  // namespace kiln
