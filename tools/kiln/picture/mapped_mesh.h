// Draws a mesh with its maps.
#pragma once

#include <string>
#include <vector>

#include "kiln/material.h"
#include "kiln/render.h"

namespace kiln::cli {

/// A mesh, and what is needed to draw maps on it.
struct MappedMesh {
  const Device& device;
  const Mesh& mesh;
};

/// Files of the maps of a lit picture; an empty path means none.
struct LitMapFiles {
  std::string color, occlusion, curvature;
  bool any() const { return !color.empty() || !occlusion.empty() || !curvature.empty(); }
};

/// The loaded maps of a lit picture, with three channels each; an empty image means none.
struct LitMaps {
  Image color, occlusion, bend;
  bool any() const { return count() != 0; }
  std::size_t count() const {
    return std::size_t{color.width != 0} + std::size_t{occlusion.width != 0} +
           std::size_t{bend.width != 0};
  }
};
/// Loads the maps of a lit picture. \throws Error(input)
LitMaps load_lit_maps(const LitMapFiles& maps);

/// Factors by which the strongest edges and the strongest cavities change the light.
constexpr float kEdgeLight = 1.5F, kCavityLight = 0.75F;

/// Applies maps to a lit picture of the mesh from Scene::draw(): multiplies by colours, darkens by occlusion, and by
/// curvature lightens edges and darkens cavities.
void apply_maps(const MappedMesh& dressed, const LitMaps& maps, const RenderOptions& options,
                Image& picture);

/// Draws the mesh unlit with each map, and with the map's name as caption. \throws Error(input)
Image draw_map_sheet(const MappedMesh& dressed, const std::vector<std::string>& files,
                     RenderOptions options);

/// Maps on the UVs of a mesh; an empty image means none.
struct MaterialAtlases {
  /// Maps of three channels each: normals as n/2 + 1/2, colours as sRGB, occlusion as grey
  Image normal, color, occlusion;
  bool any() const { return normal.width + color.width + occlusion.width != 0; }
};

/// Combines the normal, colour and occlusion textures of all materials into one atlas each: a square grid with one cell
/// per set of textures. Moves the UVs of `mesh` into the cells, and keeps its original tangents. Values combine
/// textures and factors as a renderer does.
/// \param materials  in the order of Mesh::material_names; empty: no maps
/// \param warnings   receives "own-maps" if the mesh is shown without maps: because a texture cannot be read, or
/// because its UVs leave the unit square and there are several textures, or one is transformed or does not repeat
MaterialAtlases make_material_atlases(const std::vector<Material>& materials, Mesh& mesh,
                                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
