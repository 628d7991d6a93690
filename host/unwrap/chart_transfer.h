// Transfers charts from a proxy to the finer surface.
#pragma once

#include <cstddef>

#include "unwrap/chart_choice.h"
#include "unwrap/chart_proxy.h"

namespace kiln {

/// Makes charts of the finer surface from those of the proxy. Each chart consists of the pieces of its proxy chart's
/// triangles. Its seams are straightened, and it is flattened, starting from the proxy chart's layout. If it cannot be
/// flattened within the limits, new charts are grown from its triangles.
/// \param chosen  charts of the proxy
/// \param regrown    [out] number of triangles in newly grown charts
/// \returns charts of the surface, each a disc and injective
ChosenCharts transfer_charts(const ChartSurface& surface, const VertexFans& fans,
                             const ChartProxy& proxy, const ChosenCharts& chosen,
                             const ChartLimits& limits, int threads, std::size_t& regrown);

}  // namespace kiln
