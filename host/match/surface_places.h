// Places spread over the low poly, as a match takes samples.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/low_surface.h"
#include "texel/texels.h"

namespace kiln {

struct SurfacePlaces {
  std::vector<std::uint32_t> triangle;
  std::vector<float> u, v;  ///< Weights of corners 1 and 2
  TexelBand band;           ///< The same on the device, directions as the corners say; no texels
  std::size_t size() const { return triangle.size(); }
};

/// About `wanted` places, even by area, and three near the corners of each triangle. Triangles that are not
/// usable have none. The order is that of the triangles.
SurfacePlaces spread_places(cl::Context& context, const LowSurface& surface, std::size_t wanted);

}  // namespace kiln
