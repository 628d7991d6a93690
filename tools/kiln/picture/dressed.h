// Pictures of a mesh with its maps.
#pragma once

#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/kiln.h"
#include "kiln/render.h"

namespace kiln::cli {

/// A mesh and how to draw maps on it.
struct Dressed {
  const Device& device;
  const Mesh& mesh;
};

/// Files of the maps of a lit picture; empty: none.
struct DressMaps {
  std::string color, occlusion, curvature;
  bool any() const { return !color.empty() || !occlusion.empty() || !curvature.empty(); }
};

/// The loaded maps, with three channels each; an empty image means none.
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

/// Light factors of the strongest edges and cavities.
constexpr float kEdgeLight = 1.5F, kCavityLight = 0.75F;

/// Applies maps to a lit picture of the mesh (by Scene::draw): multiplies colours, darkens by occlusion, and by
/// curvature lightens edges and darkens cavities.
void dress(const Dressed& dressed, const Dress& maps, const RenderOptions& options, Image& picture);

/// Draws the mesh unlit with each map, with the map's name as caption. \throws Error(input)
Image map_sheet(const Dressed& dressed, const std::vector<std::string>& files,
                RenderOptions options);

/// Maps over a mesh's UVs; an empty image means none.
struct OwnMaps {
  Image normal, color, occlusion;  ///< Three channels each: n/2 + 1/2, sRGB, grey
  bool any() const { return normal.width + color.width + occlusion.width != 0; }
};

/// Combines the normal, colour and occlusion textures of all materials into one atlas each: a square grid with one cell
/// per set of textures. Moves the UVs of `mesh` into its cells and keeps its original tangents. Values combine textures
/// and factors as a renderer does.
/// \param materials  in the order of Mesh::material_names; empty: no maps
/// \param warnings   receives "own-maps" if the mesh is shown without maps: its UVs leave the unit square while there
///                   are several textures, or transformed or non-repeating ones; or a texture cannot be read
OwnMaps take_own_maps(const std::vector<Material>& materials, Mesh& mesh,
                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
