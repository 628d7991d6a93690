// Errors of maps other than the normal map, for plans with bounds on them.
#pragma once

#include <span>
#include <vector>

#include "kiln/bake.h"
#include "mesh/low_surface.h"
#include "source/high_poly.h"

namespace kiln {

/// \throws Error(usage) for a bound that is out of range, occurs twice, or belongs to a map that has no errors or is
///         not baked
void check_bounds(const BakeOptions& bake, std::span<const MapBound> bounds);

/// Sets the allowed noise of occlusion rays to half of the bound on the error of ambient occlusion, unless the options
/// set that noise.
void reserve_bound_for_rays(std::span<const MapBound> bounds, BakeOptions& bake);

/// Measures the errors of a bake's maps, in the order of the bounds. Maps are filtered as in renderers, at the centres
/// of the cells of a grid, and compared with a reference bake of these points. The number of cells along a side is odd,
/// so that their centres do not coincide with those of the texels.
/// \param bake  options of `result`
/// \throws Cancelled
std::vector<MapReached> reached_bounds(const Source::Impl& high, const Mesh& low,
                                       const BakeOptions& bake, std::span<const MapBound> bounds,
                                       const BakeResult& result);

bool are_all_bounds_reached(std::span<const MapReached> bounds);

}  // namespace kiln
