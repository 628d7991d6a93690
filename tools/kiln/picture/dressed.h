// Pictures of a mesh with its maps over it.
#pragma once

#include <string>
#include <vector>

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

}  // namespace kiln::cli
