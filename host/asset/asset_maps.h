// Slots of a material for baked maps.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "kiln/asset.h"
#include "kiln/map.h"

namespace kiln {

/// asset_maps(). \param before  called with each map and its name, before it is converted by to_stored()
AssetMaps asset_maps(std::span<BakedMap> maps,
                     const std::function<void(BakedMap&, const std::string&)>& before,
                     std::string* left);

}  // namespace kiln
