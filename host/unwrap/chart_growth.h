// Grows charts on a surface: triangles are merged into nearly flat patches, and patches into charts that can be
// flattened.
#pragma once

#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// Grows charts in three passes. Every chart stays a disc in each of them:
///
/// 1. Triangles are merged into patches greedily, while their normals are similar. The next merge is always the one
///    with the smallest increase of the normals' variance per length of removed edges.
/// 2. Patches that cannot be flattened within the limits are split along their tree of merges.
/// 3. Patches are merged into charts greedily, in the same order. To test a merge, both layouts are placed edge to
///    edge, relaxed, and pulled apart where they overlap slightly. The merge is accepted if the result is injective and
///    within the limits.
///
/// A single triangle is always flat, so there is always a result. Deterministic.
/// \param borders  [in, out] on entry: as constructed for the surface; on return: with the charts' edges glued
/// \returns charts, each injective
std::vector<FlatChart> grow_charts(const ChartSurface& surface, ChartBorders& borders,
                                   const ChartLimits& limits, int threads = 0);

/// Flattens a chart that has no layout yet: projects it to its mean plane, then relaxes it.
/// \returns whether it is injective
bool flatten_chart(FlatChart& chart, const ChartSurface& surface);

}  // namespace kiln
