// Normals that see a surface's shape, but not its roughness.
#pragma once

#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// Normals of the surface with vertices moved towards the mean of their neighbours, and nearly as far back:
/// what is only a few edges wide goes, the rest stays (Taubin 1995). What smoothing leaves without area keeps
/// its own normal. Borders of discs that follow these need not follow each bump.
/// \param steps  there and back; 0: the surface's own
/// \returns one a triangle
std::vector<Vec3d> smoothed_normals(const ChartSurface& surface, int steps);

}  // namespace kiln
