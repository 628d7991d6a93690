// Assigns baked maps to the slots of a material.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "kiln/asset.h"
#include "kiln/map.h"

namespace kiln {

/// Assigns maps to the slots of a material by their names.
/// \param before  called with each map and its name, before to_stored() converts it
AssetMaps asset_maps(std::span<BakedMap> maps,
                     const std::function<void(BakedMap&, const std::string&)>& before,
                     std::string* left);

}  // namespace kiln
