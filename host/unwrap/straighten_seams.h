// Straightens seams: moves triangles that protrude from one chart into the notch of another.
#pragma once

#include <cstdint>
#include <vector>

#include "unwrap/chart_growth.h"

namespace kiln {

/// Where a seam between two charts turns around a vertex, one or two triangles lie on its inner side. They move to the
/// chart on the other side if that shortens the seam: by an edge and a vertex, or in length. They are laid into the
/// notch of that chart's layout. A move is rejected if it would distort them beyond the limits, or touch the border
/// elsewhere. Charts stay discs and injective. Deterministic.
/// \param borders  rings may be out of date; they are rebuilt
void trim_charts(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                 std::vector<FlatChart>& charts);

/// The same for charts without a layout: every move that shortens a seam is made.
/// \param label  chart of each triangle; updated
void straighten_seams(const ChartSurface& surface, ChartBorders& borders,
                      std::vector<std::uint32_t>& label);

}  // namespace kiln
