// Maps that a mesh's own materials name, as pictures of it show them.
#pragma once

#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/kiln.h"

namespace kiln::cli {

/// Maps over a mesh's UVs; of no texels: none.
struct OwnMaps {
  Image normal, color, occlusion;  ///< Three channels each: n/2 + 1/2, sRGB, grey
  bool any() const { return normal.width + color.width + occlusion.width != 0; }
};

/// The pictures of normals, colours and occlusion that materials name, side by side in one map each: a cell for each
/// set of pictures, in rows of as many cells as there are rows. Moves the UVs of `mesh` there, and gives it the
/// tangents of before. Values are those of the pictures and factors, as a renderer takes them.
/// \param materials  as Mesh::material_names; none: no maps
/// \param warnings   "own-maps" where the mesh is shown without: of several sets whose UVs leave the unit square, or
///                   with a picture that cannot be read
OwnMaps take_own_maps(const std::vector<Material>& materials, Mesh& mesh,
                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
