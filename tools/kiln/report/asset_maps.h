// Maps of a bake as the pictures of an asset's material hold them.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "kiln/asset.h"
#include "kiln/bake.h"

namespace kiln::cli {

/// Brings maps to what a material takes: emission into [0, 1] with its strength, the shape's occlusion darkened by
/// HIGH's picture of it, normals of HIGH's normal maps in place of its shape's. \returns places in `maps`
/// \param store  from a map's values to what a file holds of them
/// \param left   becomes the names of maps that a material has no place for, with commas
AssetMaps asset_maps(std::span<BakedMap> maps,
                     const std::function<void(BakedMap&, const std::string&)>& store,
                     std::string& left);

}  // namespace kiln::cli
