// Finds the best cut of a chart in two, for several prices at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "unwrap/chart_cuts.h"

namespace kiln {

/// The neighbour across each side of a chart's triangles, by places in the chart; kNoIndex at its border.
using ChartNeighbours = std::vector<std::uint32_t>;

/// The best cut of a chart at one price.
struct ChartCut {
  double gain = 0;    ///< Area saved beyond the price; 0 where no cut is worth it.
  double length = 0;  ///< Length of the edges that it opens.
  std::vector<std::uint8_t>
      apart;  ///< Per triangle of the chart: whether it is of the part cut off.

  /// The gain a cut of another length needs to be better.
  double gain_at(double other) const { return gain > 0 ? gain / length * other : 0; }
};

/// The area of the smallest upright box around a chart, of those along a few directions.
double smallest_box(const FlatChart& chart);

/// A chart as the search sees it.
class CutShape {
 public:
  /// Directions in half a turn; boxes are upright along each two that are square to each other.
  static constexpr std::size_t kDirections = 16;
  /// Extents of points along each direction, then against it, so that all are maxima.
  struct Reach {
    std::array<float, 2 * kDirections> to;
    Reach() { to.fill(-std::numeric_limits<float>::max()); }
    void add(const Reach& other) {
      for (std::size_t d = 0; d < to.size(); ++d) {
        to[d] = to[d] < other.to[d] ? other.to[d] : to[d];
      }
    }
    /// Area of the box along each two directions that are square to each other.
    double smallest_box() const;
  };
  /// Two triangles of the chart that are neighbours; the vertices and the length of their edge.
  struct Edge {
    std::uint32_t a = 0, b = 0;
    std::array<std::uint32_t, 2> ends{};
    double length = 0;
  };
  /// A triangle at the chart's border, and its vertex there.
  struct Rim {
    std::uint32_t triangle = 0, vertex = 0;
  };

  /// \param chart  viewed, not copied
  CutShape(const ChartSurface& surface, const FlatChart& chart, const ChartNeighbours& neighbour);

  /// True if a cut of any length could be worth its price.
  bool may_gain(const CutPrice& price) const;
  /// The best cut along lines across one direction, at each price.
  std::vector<ChartCut> best_cuts(std::size_t direction, std::span<const CutPrice> prices) const;

  const FlatChart& chart;
  std::vector<Edge> edges;   ///< Each once.
  std::vector<Rim> rim;      ///< All there are.
  std::vector<Reach> reach;  ///< One per vertex.
  Reach whole;               ///< Reach of all vertices.
  double area = 0;           ///< Area of the surface.
  double box = 0;            ///< The smallest upright box's.
};

}  // namespace kiln
