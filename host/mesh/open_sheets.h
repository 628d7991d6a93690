// Single open sheets of a low poly: leaf cards, decals, planes under a relief.
#pragma once

#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

/// Half the diagonal of the box of each triangle's sheet, frame units; 0 where it is on none. A sheet
/// is a connected part with a border. Its faces all look to one side, so that all of it can be seen at
/// once. What such a sheet stands for may lie far off it, since nothing of its own is in the way.
std::vector<float> sheet_sizes(const LowSurface& surface);

}  // namespace kiln
