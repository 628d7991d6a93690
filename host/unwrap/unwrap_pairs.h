// UV unwrapping by pairs of triangles that are packed as rectangles: see unwrap().
#pragma once

#include <vector>

#include "kiln/unwrap.h"
#include "mesh/triangle_shape.h"

namespace kiln {

/// \param shapes  shapes of the mesh's triangles, at least one of positive area
/// \param report  receives everything except seconds and degenerate triangles; empty on entry; may be null
Mesh unwrap_pairs(const Mesh& mesh, const UnwrapOptions& options,
                  const std::vector<TriangleShape>& shapes, UnwrapReport* report);

}  // namespace kiln
