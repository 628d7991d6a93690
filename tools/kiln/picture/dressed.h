// Pictures of a mesh with its maps over it.
#pragma once

#include <string>
#include <vector>

#include "kiln/kiln.h"

namespace kiln::cli {

/// A mesh whose maps are drawn over it.
struct Dressed {
  const Device& device;
  const Mesh& mesh;
};

/// Gives a lit picture of the mesh (by Scene::draw) the colours of one map, and darkens it by another.
/// \param color, occlusion  files; empty: none
/// \throws Error(input)
void dress(const Dressed& dressed, const std::string& color, const std::string& occlusion,
           const RenderOptions& options, Image& picture);

/// The mesh with each map over it, without light, and the map's name below. \throws Error(input)
Image map_sheet(const Dressed& dressed, const std::vector<std::string>& files,
                RenderOptions options);

}  // namespace kiln::cli
