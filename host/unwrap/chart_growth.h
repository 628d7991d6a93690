// Grows charts on a surface: triangles are merged into nearly flat patches, and patches into charts that can be
// flattened.
#pragma once

#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// Grows charts in three passes, each of which keeps every chart a disc:
///
/// 1. Patches: greedy merges while normals agree. The first merge is the one with the smallest increase of the
///    normals' variance, divided by the length of the removed edge.
/// 2. Patches without a flat map within the limits are split along their tree of merges.
/// 3. Charts: greedy merges in the same order, each tried: both sides are laid edge to edge, relaxed, and pulled
///    apart where they overlap slightly. The merge is accepted if the result is injective and within the limits.
///
/// A single triangle is always flat, so there is always a result. Deterministic.
/// \param borders  [in, out] in: as constructed for the surface; out: with glued edges
/// \returns charts, each injective
std::vector<FlatChart> grow_charts(const ChartSurface& surface, ChartBorders& borders,
                                   const ChartLimits& limits, int threads = 0);

/// Flattens a chart without an initial layout: projects it, then relaxes it.
/// \returns whether it is injective
bool flatten_chart(FlatChart& chart, const ChartSurface& surface);

}  // namespace kiln
