// Open sheets of a low poly: leaf cards, decals, planes under a relief.
#pragma once

#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

/// Per triangle, half the diagonal of the bounding box of its sheet, in frame units; 0 if it is on none. A sheet is a
/// connected part with a border whose faces are all visible from one direction. Its high poly may be far away, since
/// no other surface of the part lies between.
std::vector<float> sheet_sizes(const LowSurface& surface);

}  // namespace kiln
