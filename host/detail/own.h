// Maps of the caller's own.
#pragma once

#include <string_view>

#include "detail/registry.h"
#include "kiln/own_map.h"

namespace kiln {

/// The row of a map. \param map  outlives the row  \param name  outlives the program's bakes
/// \throws Error(usage) for a number of channels that there is not
MapRow own_map(const OwnMap& map, std::string_view name);

}  // namespace kiln
