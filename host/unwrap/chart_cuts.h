// Cuts charts into parts that pack more tightly.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// The price of a cut, in units of the surface.
struct CutPrice {
  /// Half of the padding, which both sides of a cut need.
  double margin = 0;
  /// Area of bounding boxes that each unit of a cut's length must save in addition.
  double seam = 0;
  /// Waste of large charts, which pack less tightly: this times a chart's squared area.
  double size = 0;
  /// Least area of a part.
  double least = 0;
};

/// The charts after cutting.
struct CutCharts {
  std::vector<std::uint8_t> glued;  ///< Per half-edge of the surface; edges that were cut are 0.
  std::vector<FlatChart> charts;
};

/// Cuts charts in two along edges near straight lines: limbs off bodies, bends apart (after Limper, Vining, Sheffer,
/// "Box Cutter", 2018). The waste of a chart is the area of its smallest bounding box beyond its own. The cut that
/// saves most for its length is chosen; then both parts are searched in turn, until no cut is worth its price. Every
/// part is a disc and keeps its layout, so it stays injective. Deterministic.
/// \param borders  from grow_charts()
/// \param prices   a separate result is computed for each; parts that several prices lead to are searched once
/// \returns one for each price
std::vector<CutCharts> cut_charts(const ChartSurface& surface, const ChartBorders& borders,
                                  std::span<const CutPrice> prices,
                                  const std::vector<FlatChart>& charts, int threads);

/// Cuts a chart in two if both parts are discs that stay injective.
/// \param is_apart  per triangle of the chart: it belongs to the cut-off part
/// \param local     scratch, one entry a triangle of the surface; on entry, the index in the chart for each of its
///     triangles
/// \param apart     [out] the cut-off part; `chart` keeps the rest
/// \returns false if nothing was changed
bool cut_apart(const ChartSurface& surface, ChartBorders& borders,
               const std::vector<std::uint8_t>& is_apart, std::vector<std::uint32_t>& local,
               FlatChart& chart, FlatChart& apart);

}  // namespace kiln
