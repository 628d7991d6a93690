// Errors that plans are to reach of maps other than the normal map.
#pragma once

#include <span>
#include <vector>

#include "kiln/bake.h"
#include "mesh/low_surface.h"
#include "source/high_poly.h"

namespace kiln {

/// \throws Error(usage) for a bound out of range, given twice, or of a map that has none or is not baked
void check_bounds(const BakeOptions& bake, std::span<const MapBound> bounds);

/// Half of a bound of ambient occlusion goes to the noise of its rays, unless the options say more.
void leave_to_rays(std::span<const MapBound> bounds, BakeOptions& bake);

/// Errors that a bake has reached, in the bounds' order. The maps are read as renderers do, at the centres of an odd
/// grid's texels. They are held against a bake of these alone.
/// \param bake  that `result` was baked with
/// \throws Cancelled
std::vector<MapReached> reached_bounds(const Source::Impl& high, const Mesh& low,
                                       const BakeOptions& bake, std::span<const MapBound> bounds,
                                       const BakeResult& result);

bool all_reached(std::span<const MapReached> bounds);

}  // namespace kiln
