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

/// Factor of the strongest edges' light, and that of the strongest cavities.
constexpr float kEdgeLight = 1.5F, kCavityLight = 0.75F;

/// Gives a lit picture of the mesh (by Scene::draw) the colours of a map. Darkens it by occlusion,
/// lightens edges and darkens cavities. \throws Error(input)
void dress(const Dressed& dressed, const DressMaps& maps, const RenderOptions& options,
           Image& picture);

/// The mesh with each map over it, without light, and the map's name below. \throws Error(input)
Image map_sheet(const Dressed& dressed, const std::vector<std::string>& files,
                RenderOptions options);

}  // namespace kiln::cli
