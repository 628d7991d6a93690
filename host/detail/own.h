// Maps that are computed by a function that the caller supplies.
#pragma once

#include "detail/registry.h"
#include "kiln/map.h"

namespace kiln {

/// Makes the registry row of a custom map.
/// \param map  must outlive the row
/// \throws Error(usage) for an unsupported number of channels; Error(input) if the source is
///   rejected
MapRow own_map(const OwnMap& map);

}  // namespace kiln
