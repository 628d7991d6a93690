// Polygons into triangles, as readers of files cut them.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/types.h"

namespace KILN_PUBLIC kiln {

/// Cuts a polygon of n corners into n - 2 triangles of indices into `corners`.
/// \param corners  in order around it, in double precision; fewer than 3 give no triangle
std::vector<Triangle> triangulate_polygon(std::span<const std::array<double, 3>> corners,
                                          Triangulation rule = Triangulation::automatic);

}  // namespace kiln
