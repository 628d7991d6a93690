// Grows charts on a surface: triangles are merged to nearly flat patches, patches to charts that can be flattened.
#pragma once

#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// Grows charts in three passes, each of which keeps every chart a disc:
///
/// 1. Patches: greedy merges while normals agree. The merge with the least rise of the normals' variance for the
///    longest removed edge comes first.
/// 2. Patches without a flat map within the limits are split as they were merged.
/// 3. Charts: greedy merges in the same order, each tried: both sides are laid edge to edge, relaxed, and pulled
///    apart where they overlap slightly. The merge is accepted if the result is injective and within the limits.
///
/// A single triangle is always flat, so there is always a result. Deterministic.
/// \param borders  as constructed for the surface; out: glued edges
/// \returns charts, each injective
std::vector<FlatChart> grow_charts(const ChartSurface& surface, ChartBorders& borders,
                                   const ChartLimits& limits, int threads = 0);

/// Flattens a chart without an initial layout: projects it, then relaxes it.
/// \returns whether it is injective
bool lay_flat(FlatChart& chart, const ChartSurface& surface);

}  // namespace kiln
