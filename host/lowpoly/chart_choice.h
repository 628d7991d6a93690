// Which charts a surface gets: grown and cut in a few ways, those that pack well for few vertices.
#pragma once

#include <optional>
#include <vector>

#include "kiln/lowpoly.h"
#include "lowpoly/bitmap_packing.h"
#include "lowpoly/chart_borders.h"
#include "lowpoly/flat_chart.h"

namespace kiln {

/// Where padding is weighed before packing: the share of texels that charts are expected to cover.
inline constexpr double kExpectedCoverage = 0.75;
/// No part is smaller than this share of the mesh.
inline constexpr double kLeastPart = 0.003;
/// A vertex that counts weighs this, over the positions, as a share of the map's texels.
inline constexpr double kVertexPrice = 2;

struct ChosenCharts {
  ChartBorders borders;  ///< What is glued of the surface's edges.
  std::vector<FlatChart> charts;
  std::optional<PackState> packed = std::nullopt;  ///< How they were packed, if they were.
  bool any_size = false;  ///< Whether every size and border would have led to them.
};

/// Grows charts in a few ways, cuts each at a few prices, and packs what comes out roughly. Takes the charts
/// that use most texels for their vertices. Deterministic.
ChosenCharts choose_charts(const ChartSurface& surface, const UnwrapOptions& options, int threads);

/// Lowers the energy of charts that are injective, and gives each the area of its surface.
void relax_charts(std::vector<FlatChart>& charts, int threads);

/// The chart's border as it lies.
std::vector<FlatPoint> outline_of(const FlatChart& chart);
std::vector<Outline> outlines_of(const std::vector<FlatChart>& charts);

}  // namespace kiln
