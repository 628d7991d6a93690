// True if a normal map's green points the other way.
#pragma once

#include <vector>

#include "kiln/kiln.h"
#include "kiln/render.h"

namespace kiln::cli {

/// Compares rendered normals with those of the map as it is, and with its green turned round; adds a warning
/// where it fits better so, by a tenth or more.
/// \param map    without an image: nothing is done
/// \param frame  the high poly, which pictures show all of
void check_green(const Device& device, const Mesh& mesh, NormalMap map, const Scene& high,
                 const Mesh& frame, bool z_up, std::vector<Warning>& warnings);

}  // namespace kiln::cli
