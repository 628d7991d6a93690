// Chooses a surface's charts: grows them, cuts them in a few ways, keeps those that pack well with few vertices.
#pragma once

#include <optional>
#include <vector>

#include "kiln/unwrap.h"
#include "pack/bitmap_packing.h"
#include "unwrap/chart_borders.h"
#include "unwrap/flat_chart.h"

namespace kiln {

/// The share of texels that charts are expected to cover, for weighing padding before packing.
inline constexpr double kExpectedCoverage = 0.75;
/// No part is smaller than this share of the mesh.
inline constexpr double kLeastPart = 0.003;
/// A vertex that counts weighs this, over the positions, as a share of the map's texels.
inline constexpr double kVertexPrice = 2;

struct ChosenCharts {
  ChartBorders borders;  ///< Edges of the surface that are glued.
  std::vector<FlatChart> charts;
  std::optional<PackState> packed = std::nullopt;  ///< Their packing, if there is one.
  bool any_size = false;  ///< Every size and border would have led to these charts.
};

/// Grows charts, cuts them at a few prices, and packs what comes out roughly. Takes the charts that use most texels for
/// their vertices. Deterministic.
ChosenCharts choose_charts(const ChartSurface& surface, const UnwrapOptions& options, int threads);

/// Lowers the energy of charts that are injective, and gives each the area of its surface.
void relax_charts(std::vector<FlatChart>& charts, int threads);

/// The chart's border as it lies.
std::vector<Vec2d> outline_of(const FlatChart& chart);
std::vector<Outline> outlines_of(const std::vector<FlatChart>& charts);

}  // namespace kiln
