// Where a chart is best cut in two, for several prices at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "lowpoly/chart_cuts.h"

namespace kiln {

/// Of a chart: the triangle over each side of each triangle, by places in the chart; kNoIndex at its border.
using ChartNeighbours = std::vector<std::uint32_t>;

/// The best cut of a chart at one price.
struct ChartCut {
  double gain = 0;    ///< Area saved beyond the price; 0 where no cut is worth it.
  double length = 0;  ///< Of the edges that it opens.
  std::vector<std::uint8_t>
      apart;  ///< Per triangle of the chart: whether it is of the part cut off.

  /// What a cut of another length must gain to be better.
  double gain_at(double other) const { return gain > 0 ? gain / length * other : 0; }
};

/// A chart as the search sees it.
class CutShape {
 public:
  /// Directions in half a turn; boxes are upright along each two that are square to each other.
  static constexpr std::size_t kDirections = 16;
  /// Of points along each direction.
  using Along = std::array<double, kDirections>;
  /// What points span along each direction.
  struct Extents {
    Along low, high;
    Extents();
    void add(const Along& least, const Along& most);
    double smallest_box() const;
  };

  /// \param chart  viewed, not copied, as is `neighbour`
  CutShape(const ChartSurface& surface, const FlatChart& chart, const ChartNeighbours& neighbour);

  /// The best cut along lines across one direction, at each price.
  std::vector<ChartCut> best_cuts(std::size_t direction, std::span<const CutPrice> prices) const;

  const FlatChart& chart;
  const ChartNeighbours& neighbour;
  std::vector<double> length;      ///< Of each side of each triangle.
  std::vector<std::uint32_t> rim;  ///< Triangles at the chart's border.
  std::vector<Along> along;        ///< Of each vertex.
  Extents whole;                   ///< Of all of them.
  double area = 0;                 ///< Of the surface.
  double box = 0;                  ///< The smallest upright box's.
};

}  // namespace kiln
