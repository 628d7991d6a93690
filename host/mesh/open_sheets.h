// Open sheets of a low poly, such as leaf cards, decals, and planes under a relief.
#pragma once

#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

/// For each triangle, half the diagonal of its sheet's bounding box, in frame units; 0 if it belongs to no sheet. A
/// sheet is a connected part with a border whose faces can all be seen from one direction. The high poly may be far
/// away from a sheet, since no other surface of the part lies between them.
std::vector<float> sheet_sizes(const LowSurface& surface);

}  // namespace kiln
