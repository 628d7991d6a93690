// Charts of a proxy, taken over to the surface that it stands for.
#pragma once

#include <cstddef>

#include "unwrap/chart_choice.h"
#include "unwrap/chart_proxy.h"

namespace kiln {

/// Every chart becomes the pieces of its triangles. Its seams are straightened, and it is laid flat from where the
/// proxy's chart lies. Where that has no map within the limits, charts are grown anew.
/// \param chosen  of the proxy
/// \param anew    [out] triangles whose charts were
/// \returns charts of the surface, each a disc that is injective
ChosenCharts transfer_charts(const ChartSurface& surface, const VertexFans& fans,
                             const ChartProxy& proxy, const ChosenCharts& chosen,
                             const ChartLimits& limits, int threads, std::size_t& anew);

}  // namespace kiln
