// The finest contour as a mesh.
#pragma once

#include "kiln/mesh.h"
#include "volume/fine_surface.h"

namespace kiln {

/// With the vertices' normals. Edges without length are gone.
/// \throws Error(input) where the surface has no triangle
Mesh fine_mesh(const FineSurface& surface, const Volume& volume);

}  // namespace kiln
