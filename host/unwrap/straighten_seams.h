// Straightens seams: moves triangles that stick out of one chart into another's notch.
#pragma once

#include <cstdint>
#include <vector>

#include "unwrap/chart_growth.h"

namespace kiln {

/// A seam between two charts that turns round a vertex has one or two triangles on one side. They
/// go to the chart on the other side if that makes the seam shorter: by an edge and a vertex, or in
/// length. They are laid into the notch beside what is there. They stay where they were if that would bend
/// them beyond the limits, or touch the border elsewhere. Charts stay discs and injective. Deterministic.
/// \param borders  rings need not be those of the charts, and are at the end
void trim_charts(const ChartSurface& surface, ChartBorders& borders, const ChartLimits& limits,
                 std::vector<FlatChart>& charts);

/// The same of charts that do not lie flat yet: whatever makes seams shorter is done.
/// \param label  of each triangle its chart; out: after the changes
void straighten_seams(const ChartSurface& surface, ChartBorders& borders,
                      std::vector<std::uint32_t>& label);

}  // namespace kiln
