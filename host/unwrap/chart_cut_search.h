// Finds the best cut of a chart in two, for several costs of a cut (CutPrice) at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "unwrap/chart_cuts.h"

namespace kiln {

/// For each side of a chart's triangles, the index in the chart of the triangle across it; kNoIndex at the chart's
/// border.
using ChartNeighbours = std::vector<std::uint32_t>;

/// The best cut of a chart at one price.
struct ChartCut {
  double gain = 0;    ///< Saved area minus the price; 0 if no cut is worth its price
  double length = 0;  ///< Length of the opened edges
  /// 1 for each triangle of the chart that belongs to the cut-off part
  std::vector<std::uint8_t> apart;

  /// The gain above which another cut, whose seam has the length `other`, is better than this one.
  double gain_at(double other) const { return gain > 0 ? gain / length * other : 0; }
};

/// Area of a chart's smallest bounding box over several rotations.
double smallest_box(const FlatChart& chart);

/// A chart with the lengths, areas and extents that the search for cuts needs.
class CutShape {
 public:
  /// Number of directions in 180 degrees. Bounding boxes are aligned to each pair of perpendicular directions.
  static constexpr std::size_t kDirections = 16;
  /// Largest coordinates of points along each direction, and along the opposite direction.
  struct Extents {
    std::array<float, 2 * kDirections> to;
    Extents() { to.fill(-std::numeric_limits<float>::max()); }
    void add(const Extents& other) {
      for (std::size_t d = 0; d < to.size(); ++d) {
        to[d] = to[d] < other.to[d] ? other.to[d] : to[d];
      }
    }
    /// Smallest area of an oriented bounding box, over all pairs of perpendicular directions.
    double smallest_box() const;
  };
  /// Two adjacent triangles of the chart, and the vertices and length of their shared edge.
  struct Edge {
    std::uint32_t a = 0, b = 0;
    std::array<std::uint32_t, 2> ends{};
    double length = 0;
  };
  /// A triangle at the chart's border, and one of its vertices that lies on the border.
  struct BorderVertex {
    std::uint32_t triangle = 0, vertex = 0;
  };

  /// \param chart  must outlive this object
  CutShape(const ChartSurface& surface, const FlatChart& chart, const ChartNeighbours& neighbour);

  /// True if any cut could be worth its price.
  bool may_reduce_cost(const CutPrice& price) const;
  /// The best cut along lines perpendicular to one direction, at each price.
  std::vector<ChartCut> best_cuts(std::size_t direction, std::span<const CutPrice> prices) const;

  const FlatChart& chart;
  std::vector<Edge> edges;  ///< Every inner edge once
  /// Every border vertex, with each of its triangles at the border
  std::vector<BorderVertex> border_vertices;
  std::vector<Extents> vertex_extents;  ///< Extent of each vertex
  Extents chart_extents;                ///< Extent of the whole chart
  double area = 0;                      ///< Area of the chart on the surface
  double box_area = 0;                  ///< Area of the chart's smallest bounding box
};

}  // namespace kiln
