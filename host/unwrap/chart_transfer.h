// Transfers charts from a proxy to the finer surface.
#pragma once

#include <cstddef>

#include "unwrap/chart_choice.h"
#include "unwrap/chart_proxy.h"

namespace kiln {

/// A chart becomes the pieces of its triangles. Its seams are straightened, and it is flattened from the proxy chart's
/// layout. Where this finds no map within the limits, new charts are grown.
/// \param chosen  charts of the proxy
/// \param anew    [out] number of triangles in charts that were grown anew
/// \returns charts of the surface, each a disc and injective
ChosenCharts transfer_charts(const ChartSurface& surface, const VertexFans& fans,
                             const ChartProxy& proxy, const ChosenCharts& chosen,
                             const ChartLimits& limits, int threads, std::size_t& anew);

}  // namespace kiln
