// Open sheets of a low poly: leaf cards, decals, planes under a relief.
#pragma once

#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

/// For each triangle, half the diagonal of its sheet's bounding box, in frame units; 0 if it does not belong to a
/// sheet. A sheet is a connected part with a border whose faces are all visible from one direction. The high poly may
/// be far away from a sheet, since no other surface of the part lies between them.
std::vector<float> sheet_sizes(const LowSurface& surface);

}  // namespace kiln
