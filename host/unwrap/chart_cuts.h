// Cuts charts into parts that pack more tightly.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// The price of a cut, as area of the surface.
struct CutPrice {
  /// Half of the padding, as a length; both sides of a cut need it.
  double margin = 0;
  /// Area of bounding boxes that each unit of a cut's length must save in addition.
  double seam = 0;
  /// Factor by which a chart's squared area is multiplied to estimate the space that packing wastes: large charts pack
  /// less tightly.
  double size = 0;
  /// Minimum area of a part.
  double min_part_area = 0;
};

/// The charts after cutting.
struct CutCharts {
  /// 1 for each glued half-edge of the surface; 0 on edges that were cut
  std::vector<std::uint8_t> glued;
  std::vector<FlatChart> charts;
};

/// Cuts charts in two along edges near straight lines, for instance a limb from a body, or a bent strip at the bend
/// (after Limper, Vining, Sheffer, "Box Cutter", 2018). The waste of a chart is the area of its smallest bounding box
/// minus its own area. The cut that saves most for its length is chosen; then both parts are searched in turn, until
/// no cut is worth its price. Every part is a disc and keeps its layout, so it stays injective. Deterministic.
/// \param borders  from grow_charts()
/// \param prices   costs of a cut; a separate result is computed for each, and a part that results for several is
///        searched once
/// \returns one for each price
std::vector<CutCharts> cut_charts(const ChartSurface& surface, const ChartBorders& borders,
                                  std::span<const CutPrice> prices,
                                  const std::vector<FlatChart>& charts, int threads);

/// Cuts a chart in two if both parts are discs that stay injective.
/// \param is_apart  1 for each triangle of the chart that belongs to the cut-off part
/// \param index_in_chart     scratch, one entry per triangle of the surface; on entry, the index in the chart for each of the
///     chart's triangles
/// \param apart     [out] the cut-off part; `chart` becomes the other part
/// \returns false if nothing was changed
bool cut_apart(const ChartSurface& surface, ChartBorders& borders,
               const std::vector<std::uint8_t>& is_apart,
               std::vector<std::uint32_t>& index_in_chart, FlatChart& chart, FlatChart& apart);

}  // namespace kiln
