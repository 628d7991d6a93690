// Shading frames of the low poly, for the kernels that write and read normal maps.
#pragma once

#include <vector>

#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"

namespace kiln {

/// Corner normals, tangents and face frames of all triangles, in the surface's order.
/// \param with_uvs  true: triangles without UVs, to which no texel belongs, get zeros, which saves time for texture
///        sets
std::vector<kiln_low_shading> low_shading(const LowSurface& surface, bool with_uvs = false);
/// low_shading() of the triangles LowSurface::with_uvs, in their order.
std::vector<kiln_low_shading> shading_with_uvs(const LowSurface& surface);

}  // namespace kiln
