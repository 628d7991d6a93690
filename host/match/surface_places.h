// Points on the low poly as samples for a match.
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
struct LowPolyPoint {
  std::uint32_t triangle = 0;
  float u = 0, v = 0;  ///< Barycentric weights of the triangle's corners 1 and 2
};

Vec3d position_at(const LowSurface& surface, const LowPolyPoint& point);

/// Converts points to the samples of a map that has one row and one sample per texel. Directions are
/// interpolated from the corners; if these cancel out, the direction is the face's normal.
/// \param place returns the point with an index below `count`; called from several threads
/// \param multiple the capacity is rounded up to a multiple of this
TexelBand band_of_points(cl::Context& context, const LowSurface& surface, std::size_t count,
                         const std::function<LowPolyPoint(std::size_t)>& point,
                         std::uint32_t multiple = 1);

struct SampledPoints {
  std::vector<LowPolyPoint> list;
  TexelBand band;  ///< The points as samples on the device
};

/// About `target_count` points, evenly distributed by area, and three near the corners of each triangle. Unusable
/// triangles have no points. Points are in the order of triangles.
SampledPoints spread_points(cl::Context& context, const LowSurface& surface,
                            std::size_t target_count);

}  // namespace kiln
