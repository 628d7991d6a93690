// Chooses a surface's charts: grows them, cuts them with several cost weights, and keeps the candidate that packs best for its
// number of vertices.
#pragma once

#include <optional>
#include <vector>

#include "kiln/unwrap.h"
#include "pack/bitmap_packing.h"
#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// Expected coverage of the map by charts, for estimates of padding before packing.
inline constexpr double kExpectedCoverage = 0.75;
/// Smallest part that a cut may leave, as a share of the mesh's area.
inline constexpr double kMinPartShare = 0.003;
/// Price of an added vertex: this share of the map's texels, divided by the number of positions.
inline constexpr double kVertexPrice = 2;

struct ChosenCharts {
  ChartBorders borders;  ///< State (glued or open) of the surface's edges
  std::vector<FlatChart> charts;
  std::optional<PackState> packed = std::nullopt;  ///< Packing of the charts, if computed
  bool is_independent_of_size =
      false;  ///< True if the charts do not depend on the map's size and padding
};

/// Grows charts, cuts them with several penalties, and packs each candidate in a few orders. Returns the candidate with
/// the highest score: its coverage of the map minus the price of the vertices that its seams add. Deterministic.
ChosenCharts choose_charts(const ChartSurface& surface, const UnwrapOptions& options, int threads);

/// Lowers the energy of injective charts, then scales each chart to its area on the surface.
void relax_charts(std::vector<FlatChart>& charts, int threads);

/// The chart's border as a polygon in the plane of its layout.
std::vector<Vec2d> outline_of(const FlatChart& chart);
std::vector<Outline> outlines_of(const std::vector<FlatChart>& charts);

}  // namespace kiln
