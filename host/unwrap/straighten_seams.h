// Straightens seams: moves triangles that protrude from one chart into a notch of another.
#pragma once

#include <cstdint>
#include <vector>

#include "unwrap/chart_growth.h"

namespace kiln {

/// Where a seam between two charts turns around a vertex, one or two triangles lie on the inner side of the turn. They
/// move to the chart on the other side if that shortens the seam: by an edge and a vertex, or in length. They are added
/// to that chart's layout, in the notch. A move is rejected if it would distort the triangles beyond the limits, or if
/// they would touch the border elsewhere. Charts stay discs and injective. Deterministic.
/// \param borders  [in, out] its rings may be outdated on entry; they are rebuilt
void trim_charts(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                 std::vector<FlatChart>& charts);

/// Straightens the seams of charts without a layout: makes every move that shortens a seam.
/// \param label  chart of each triangle; updated
void straighten_seams(const ChartSurface& surface, ChartBorders& borders,
                      std::vector<std::uint32_t>& label);

}  // namespace kiln
