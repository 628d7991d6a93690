// Parts of a low poly that share their texels on purpose: mirrored halves, repeated screws.
#pragma once

#include "kiln/mesh.h"
#include "mesh/low_surface.h"

namespace kiln {

/// Finds triangles whose UVs are those of another one, whole numbers apart or not, mirrored or not, and decides
/// which of them is baked (UvCopies). Fills LowSurface::copy_of, and brings the UVs of all of them together.
/// Corners are the same within 1e-4 and a twentieth of the triangle's longest side.
void find_uv_copies(const Mesh& low, UvCopies rule, LowSurface& surface);

}  // namespace kiln
