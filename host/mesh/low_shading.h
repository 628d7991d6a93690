// Shading frames of the low poly, as the kernels that write and read normal maps take them.
#pragma once

#include <vector>

#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"

namespace kiln {

/// Corner normals, tangents and face frames of every triangle, in the surface's order.
/// \param with_uvs  of those alone, which texels show; zeros for all others: a texture set may have few
std::vector<kiln_low_shading> low_shading(const LowSurface& surface, bool with_uvs = false);

}  // namespace kiln
