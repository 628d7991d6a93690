// Adjacency of the charts of a volume's map.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shared/volume.h"

namespace kiln {

/// Vertices and edges that charts share. The corners and sides of charts are numbered 4 * chart +
/// corner; a side starts at the corner of the same number.
struct ChartAdjacency {
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  /// Chart corners at vertex v of the low poly: corner_members[corner_begins[v]] to [corner_begins[v + 1] - 1].
  std::vector<std::uint32_t> corner_begins, corner_members;
  /// Edge of each chart side; kNone if the chart has no such side
  std::vector<std::uint32_t> edges;
  /// Chart sides at edge e: edge_members[edge_begins[e]] to edge_members[edge_begins[e + 1] - 1].
  std::vector<std::uint32_t> edge_begins, edge_members;
};

/// Number of texels along all sides of a chart, corners included.
std::uint32_t ring_texels(const kiln_volume_chart& chart);

/// \param vertices  number of the low poly's vertices
ChartAdjacency find_chart_adjacency(std::span<const kiln_volume_chart> charts,
                                    std::size_t vertices);

}  // namespace kiln
