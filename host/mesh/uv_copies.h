// Parts of a low poly that share their texels on purpose: mirrored halves, repeated screws.
#pragma once

#include "kiln/mesh.h"
#include "mesh/low_surface.h"

namespace kiln {

/// Finds triangles with another one's UVs, whole numbers apart or not, mirrored or not. Decides which of
/// them is baked (UvCopies). Fills LowSurface::copy_of, and brings the UVs of all of them together.
/// Corners are the same within 1e-4 and a twentieth of the triangle's longest side. Quads and larger
/// polygons may be cut along other diagonals: a triangle is a copy, too, where several others cover it
/// wholly. No two of them overlap in it, and its corners are theirs; copy_of then names the one with the
/// largest share. Polygons that reach over the border of a unit square are compared triangle by triangle.
///
/// Deterministic. About 0.35 s for a million triangles of which none overlap, 4 s where half of them are copies.
void find_uv_copies(const Mesh& low, UvCopies rule, LowSurface& surface);

}  // namespace kiln
