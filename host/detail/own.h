// Maps of the caller's own.
#pragma once

#include "detail/registry.h"
#include "kiln/map.h"

namespace kiln {

/// The row of a map. \param map  outlives the row
/// \throws Error(usage) for a number of channels that there is not
MapRow own_map(const OwnMap& map);

}  // namespace kiln
