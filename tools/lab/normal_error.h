// The error of rendered normals, brought back onto the texels that show it.
#pragma once

#include <vector>

#include "kiln/kiln.h"

namespace kiln::cli {

/// The mean angle between HIGH's normals and the normals that LOW shows with its map. Counted are
/// all pixels of all views with a texel under them.
/// \param shown   LOW with its map
/// \param pixels  a side of the pictures
/// \returns degrees, one channel; -1 where no view sees both meshes
Image normal_error_texture(const Device& device, const Scene& high, const Scene& shown,
                           const Mesh& frame, const Mesh& low, const std::vector<ViewAngles>& views,
                           std::uint32_t width, std::uint32_t height, std::uint32_t pixels);

}  // namespace kiln::cli
