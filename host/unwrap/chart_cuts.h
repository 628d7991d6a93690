// Cuts charts into parts that pack more tightly.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// The price of a cut, in units of area on the surface.
struct CutPrice {
  /// Half of the padding, as a length. It is added on both sides of a cut.
  double margin = 0;
  /// Area of bounding boxes that a cut must save in addition, for each unit of its length.
  double seam = 0;
  /// Factor of a chart's squared area in the estimate of the space that packing wastes: large charts pack less tightly.
  double size = 0;
  /// Minimum area of a part.
  double min_part_area = 0;
};

/// Charts after cutting, and the edges that are still glued.
struct CutCharts {
  /// 1 for each glued half-edge of the surface; 0 on edges that were cut
  std::vector<std::uint8_t> glued;
  std::vector<FlatChart> charts;
};

/// Cuts charts in two along edges near straight lines, for instance a limb from a body, or a bent strip at the bend
/// (after Limper, Vining, Sheffer, "Box Cutter", 2018). A chart's waste is the area of its smallest bounding box minus
/// its own area. The cut that saves the most area per unit of its length is chosen. Then both parts are searched in
/// turn, until no cut is worth its price. Every part is a disc and keeps its layout, so it stays injective.
/// Deterministic.
/// \param borders  from grow_charts()
/// \param prices   prices of cuts. A separate result is computed for each; a part that several prices lead to is
///   searched once
/// \returns one result for each price
std::vector<CutCharts> cut_charts(const ChartSurface& surface, const ChartBorders& borders,
                                  std::span<const CutPrice> prices,
                                  const std::vector<FlatChart>& charts, int threads);

/// Cuts a chart in two if both parts are discs that stay injective.
/// \param is_apart  1 for each triangle of the chart that belongs to the cut-off part
/// \param index_in_chart  scratch memory, one entry per triangle of the surface; on entry it holds, for each triangle
///   of the chart, the index in the chart
/// \param chart     [in, out] becomes the part that remains
/// \param apart     [out] the cut-off part
/// \returns false if nothing was changed
bool cut_apart(const ChartSurface& surface, ChartBorders& borders,
               const std::vector<std::uint8_t>& is_apart,
               std::vector<std::uint32_t>& index_in_chart, FlatChart& chart, FlatChart& apart);

}  // namespace kiln
