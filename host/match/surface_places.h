// Places on the low poly as samples for a match.
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

/// Places as samples of a map of one row, one per texel. Directions are interpolated from the corners; the
/// face's normal if they cancel out.
/// \param place  returns the place of an index below `count`; called from several threads
/// \param multiple  the capacity is a multiple of this
TexelBand band_of_places(cl::Context& context, const LowSurface& surface, std::size_t count,
                         const std::function<LowPlace(std::size_t)>& place,
                         std::uint32_t multiple = 1);

struct SurfacePlaces {
  std::vector<LowPlace> list;
  TexelBand band;  ///< The places on the device
};

/// About `wanted` places, evenly distributed by area, and three near the corners of each triangle. Unusable
/// triangles have none. Places are in the order of triangles.
SurfacePlaces spread_places(cl::Context& context, const LowSurface& surface, std::size_t wanted);

}  // namespace kiln
