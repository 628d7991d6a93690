// Places on the low poly, as a match takes samples.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "texel/texels.h"

namespace kiln {

/// A point of a triangle of the low poly.
struct LowPlace {
  std::uint32_t triangle = 0;
  float u = 0, v = 0;  ///< Weights of its corners 1 and 2
};

Vec3d position_at(const LowSurface& surface, const LowPlace& place);

/// Places as the samples of a map of one row, a texel each. Directions are as the corners say; the face's normal
/// where they cancel out.
/// \param place  of each number up to `count`; asked from several threads
/// \param multiple  the capacity is a multiple of this
TexelBand band_of_places(cl::Context& context, const LowSurface& surface, std::size_t count,
                         const std::function<LowPlace(std::size_t)>& place,
                         std::uint32_t multiple = 1);

struct SurfacePlaces {
  std::vector<LowPlace> list;
  TexelBand band;  ///< The same on the device
};

/// About `wanted` places, even by area, and three near the corners of each triangle. Triangles that are not
/// usable have none. The order is that of the triangles.
SurfacePlaces spread_places(cl::Context& context, const LowSurface& surface, std::size_t wanted);

}  // namespace kiln
