// Charts cut where that lets them pack more tightly.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// The price of a cut, in units of the surface.
struct CutPrice {
  /// Half of the padding: both sides of a cut need it.
  double margin = 0;
  /// Area of upright boxes that an edge of length 1 must save beside that.
  double seam = 0;
  /// Large charts fit less well: area that is wasted, by a chart's squared area.
  double size = 0;
  /// Parts have at least this area.
  double least = 0;
};

/// The charts after cutting.
struct CutCharts {
  std::vector<std::uint8_t> glued;  ///< Per half-edge of the surface: edges that were cut are not.
  std::vector<FlatChart> charts;
};

/// Cuts charts in two along edges near straight lines: limbs off bodies, bends apart (after Limper, Vining,
/// Sheffer, "Box Cutter", 2018). A chart wastes what its smallest box has beyond it. The cut that
/// saves most for its length comes first. Then both parts are looked at, until none is worth its price. Every part
/// is a disc, laid out as it was, so it stays injective. Deterministic.
/// \param borders  as grow_charts() left them
/// \param prices   each is followed by itself; parts that several come to are looked at once
/// \returns one a price
std::vector<CutCharts> cut_charts(const ChartSurface& surface, const ChartBorders& borders,
                                  std::span<const CutPrice> prices,
                                  const std::vector<FlatChart>& charts, int threads);

/// Cuts a chart in two, where both parts are discs that stay injective.
/// \param is_apart  per triangle of the chart, whether it is of the part cut off
/// \param local     scratch, one entry a triangle of the surface: on entry, the place in the chart of each of its own
/// \param apart     [out] the part cut off; `chart` is the rest
/// \returns whether that was done; else nothing has changed
bool cut_apart(const ChartSurface& surface, ChartBorders& borders,
               const std::vector<std::uint8_t>& is_apart, std::vector<std::uint32_t>& local,
               FlatChart& chart, FlatChart& apart);

}  // namespace kiln
