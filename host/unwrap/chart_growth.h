// Charts grown on a surface: triangles become nearly flat patches, patches become charts that can be
// laid flat.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// Parameters of patch growth, before patches become charts.
struct ChartWay {
  int smoothing = 3;      ///< Steps by which the surface is smoothed first, see smoothed_normals().
  double variance = 0.2;  ///< Patches end where guide normals vary more: 1 - |mean normal|.
};

/// Grows charts in three passes, each of which keeps every chart a disc:
///
/// 1. Patches: greedy merges while the normals of the smoothed surface agree. The least rise of normals'
///    variance for the longest edge removed comes first.
/// 2. Patches that have no flat map within the limits are split as they were merged.
/// 3. Charts: greedy merges in the same order, each tried: both sides are laid edge to edge and relaxed;
///    where they overlap, the whole is relaxed from Tutte's map. The merge stands where the result is injective
///    and within the limits.
///
/// Single triangles are always flat, so there is always an answer. Deterministic.
/// \param borders  as made for the surface; at the end, what is glued
/// \returns charts, each injective
std::vector<FlatChart> grow_charts(const ChartSurface& surface, ChartBorders& borders,
                                   const ChartLimits& limits, const ChartWay& way = {},
                                   int threads = 0);

/// Decides if two charts are worth joining; gets the half-edges this glues, both charts, and the two flattened as one.
using JoinWorth = std::function<bool(std::span<const std::uint32_t> glued, const FlatChart& a,
                                     const FlatChart& b, const FlatChart& joined)>;

/// The third pass alone, for charts that are there already: joins neighbours where that is worth it.
/// \param borders  what is glued of the charts, and their rings; at the end, of those joined
void join_charts(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                 std::span<const Vec3d> guide, const JoinWorth& worth,
                 std::vector<FlatChart>& charts, int threads = 0);

/// Relaxes a chart from Tutte's map on, where there is hope. \returns whether it is injective and within
/// \param known  see injective_rounds()
bool relax_from_circle(FlatChart& chart, const ChartLimits& limits,
                       const RigidSystem* known = nullptr);

/// Lays a chart flat from nothing: projected or conformal, then relaxed.
/// \returns whether it is injective
bool lay_flat(FlatChart& chart, const ChartSurface& surface);

}  // namespace kiln
