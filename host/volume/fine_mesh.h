// The full-resolution contour as a mesh.
#pragma once

#include "kiln/mesh.h"
#include "volume/fine_surface.h"

namespace kiln {

/// Makes the mesh, with vertex normals. Zero-length edges are removed.
/// \throws Error(input) if the surface has no triangle
Mesh make_fine_mesh(const FineSurface& surface, const Volume& volume);

}  // namespace kiln
