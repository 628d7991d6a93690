// Charts grown on a surface: triangles become nearly flat patches, patches become charts that can be
// laid flat.
#pragma once

#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// Grows charts in three passes, each of which keeps every chart a disc:
///
/// 1. Patches: greedy merges while normals agree. The least rise of normals' variance for the longest edge removed
///    comes first.
/// 2. Patches that have no flat map within the limits are split as they were merged.
/// 3. Charts: greedy merges in the same order, each tried: both sides are laid edge to edge and relaxed, and pulled
///    apart where they overlap a little. The merge stands where the result is injective and within the limits.
///
/// Single triangles are always flat, so there is always an answer. Deterministic.
/// \param borders  as made for the surface; at the end, what is glued
/// \returns charts, each injective
std::vector<FlatChart> grow_charts(const ChartSurface& surface, ChartBorders& borders,
                                   const ChartLimits& limits, int threads = 0);

/// Lays a chart flat from nothing: projected, then relaxed.
/// \returns whether it is injective
bool lay_flat(FlatChart& chart, const ChartSurface& surface);

}  // namespace kiln
