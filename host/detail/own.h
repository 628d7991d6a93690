// Custom maps of the caller.
#pragma once

#include "detail/registry.h"
#include "kiln/map.h"

namespace kiln {

/// Makes the row of a custom map. \param map  must outlive the row
/// \throws Error(usage) for an unsupported number of channels
MapRow own_map(const OwnMap& map);

}  // namespace kiln
