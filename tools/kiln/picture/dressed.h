// Pictures of a mesh with its maps over it.
#pragma once

#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/kiln.h"
#include "kiln/render.h"

namespace kiln::cli {

/// A mesh whose maps are drawn over it.
struct Dressed {
  const Device& device;
  const Mesh& mesh;
};

/// Files of maps that a lit picture is made with; empty: none.
struct DressMaps {
  std::string color, occlusion, curvature;
  bool any() const { return !color.empty() || !occlusion.empty() || !curvature.empty(); }
};

/// The same as images of three channels; of no texels: none.
struct Dress {
  Image color, occlusion, bend;
  bool any() const { return count() != 0; }
  std::size_t count() const {
    return std::size_t{color.width != 0} + std::size_t{occlusion.width != 0} +
           std::size_t{bend.width != 0};
  }
};
/// \throws Error(input)
Dress load_dress(const DressMaps& maps);

/// Factor of the strongest edges' light, and that of the strongest cavities.
constexpr float kEdgeLight = 1.5F, kCavityLight = 0.75F;

/// Gives a lit picture of the mesh (by Scene::draw) the colours of a map. Darkens it by occlusion,
/// lightens edges and darkens cavities.
void dress(const Dressed& dressed, const Dress& maps, const RenderOptions& options, Image& picture);

/// The mesh with each map over it, without light, and the map's name below. \throws Error(input)
Image map_sheet(const Dressed& dressed, const std::vector<std::string>& files,
                RenderOptions options);

/// Maps over a mesh's UVs; of no texels: none.
struct OwnMaps {
  Image normal, color, occlusion;  ///< Three channels each: n/2 + 1/2, sRGB, grey
  bool any() const { return normal.width + color.width + occlusion.width != 0; }
};

/// The pictures of normals, colours and occlusion that materials name, side by side in one map each: a cell for each
/// set of pictures, in rows of as many cells as there are rows. Moves the UVs of `mesh` there, and gives it the
/// tangents of before. Values are those of the pictures and factors, as a renderer takes them.
/// \param materials  as Mesh::material_names; none: no maps
/// \param warnings   "own-maps" where the mesh is shown without: one whose UVs leave the unit square and whose pictures
///                   are several, moved or do not repeat, or with a picture that cannot be read
OwnMaps take_own_maps(const std::vector<Material>& materials, Mesh& mesh,
                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
