// Charts grown on a surface: triangles become nearly flat patches, patches become charts that can be
// laid flat.
#pragma once

#include <cstdint>
#include <vector>

#include "lowpoly/chart_borders.h"
#include "lowpoly/flat_chart.h"

namespace kiln {

/// What a chart may be distorted by.
struct ChartLimits {
  double energy = 0.06;  ///< Mean, see FlatDistortion.
  double worst = 5;      ///< At any triangle.
};

/// Grows charts in three passes, each of which keeps every chart a disc:
///
/// 1. Patches: greedy merges, the least rise of normals' variance for the longest edge removed first,
///    while normals agree.
/// 2. Patches that have no injective flat map are split as they were merged.
/// 3. Charts: greedy merges in the same order, each tried: both sides are laid edge to edge and relaxed;
///    the merge stands where the result is injective and within the limits.
///
/// Single triangles are always flat, so there is always an answer. Deterministic.
/// \param borders  as made for the surface; at the end, what is glued
/// \returns charts, each injective
std::vector<FlatChart> grow_charts(const ChartSurface& surface, ChartBorders& borders,
                                   const ChartLimits& limits);

/// Lays a chart flat from nothing: projected or conformal, then relaxed.
/// \returns whether it is injective
bool lay_flat(FlatChart& chart, const ChartSurface& surface);

bool within(const FlatChart& chart, const ChartLimits& limits);

}  // namespace kiln
