// Shading frames of the low poly, for kernels that write and read normal maps.
#pragma once

#include <vector>

#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"

namespace kiln {

/// Corner normals, tangents and face frames of all triangles, in the surface's order.
/// \param with_uvs  true: triangles without UVs get zeros, since no texel belongs to them; this saves time for texture
///   sets
std::vector<kiln_low_shading> low_shading(const LowSurface& surface, bool with_uvs = false);
/// Variant of low_shading() for the triangles in LowSurface::with_uvs only, in their order.
std::vector<kiln_low_shading> shading_with_uvs(const LowSurface& surface);

}  // namespace kiln
