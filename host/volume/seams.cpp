#include "volume/seams.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

std::uint32_t next_corner(const kiln_volume_chart& chart, std::uint32_t k) {
  return k + 1 == chart.corners ? 0 : k + 1;
}

/// Groups items by group number: finds where each group begins in the list of members, and lists
/// the members of each group in ascending order.
void group_members(const std::vector<std::uint32_t>& group_of, std::size_t groups,
                   std::vector<std::uint32_t>& begins, std::vector<std::uint32_t>& members) {
  begins.assign(groups + 1, 0);
  for (const std::uint32_t g : group_of) {
    if (g != ChartAdjacency::kNone) ++begins[g + 1];
  }
  for (std::size_t g = 0; g < groups; ++g) begins[g + 1] += begins[g];
  members.resize(begins[groups]);
  std::vector<std::uint32_t> next(begins.begin(), begins.end() - 1);
  for (std::uint32_t i = 0; i < group_of.size(); ++i) {
    if (group_of[i] != ChartAdjacency::kNone) members[next[group_of[i]]++] = i;
  }
}

}  // namespace

std::uint32_t ring_texels(const kiln_volume_chart& chart) {
  std::uint32_t count = 0;
  for (std::uint32_t k = 0; k < chart.corners; ++k) {
    const float* a = chart.texel[k];
    const float* b = chart.texel[next_corner(chart, k)];
    count += static_cast<std::uint32_t>(std::max(std::abs(a[0] - b[0]), std::abs(a[1] - b[1]))) + 1;
  }
  return count;
}

ChartAdjacency find_chart_adjacency(std::span<const kiln_volume_chart> charts,
                                    std::size_t vertices) {
  ChartAdjacency chart_adjacency;
  std::vector<std::uint32_t> vertex_of(4 * charts.size(), ChartAdjacency::kNone);
  struct Side {
    /// Numbers of the vertices at both ends; the lower number is in the high bits
    std::uint64_t vertices;
    std::uint32_t number;
  };
  std::vector<Side> sides;
  sides.reserve(vertex_of.size());
  for (std::uint32_t i = 0; i < charts.size(); ++i) {
    const kiln_volume_chart& chart = charts[i];
    for (std::uint32_t k = 0; k < chart.corners; ++k) {
      vertex_of[4 * i + k] = chart.corner[k];
      const auto [low, high] = std::minmax(chart.corner[k], chart.corner[next_corner(chart, k)]);
      sides.push_back({std::uint64_t{low} << 32 | high, 4 * i + k});
    }
  }
  group_members(vertex_of, vertices, chart_adjacency.corner_begins, chart_adjacency.corner_members);
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.vertices != b.vertices ? a.vertices < b.vertices : a.number < b.number;
  });
  chart_adjacency.edges.assign(vertex_of.size(), ChartAdjacency::kNone);
  std::uint32_t edges = 0;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (i > 0 && sides[i].vertices != sides[i - 1].vertices) ++edges;
    chart_adjacency.edges[sides[i].number] = edges;
  }
  group_members(chart_adjacency.edges, edges + 1, chart_adjacency.edge_begins,
                chart_adjacency.edge_members);
  return chart_adjacency;
}

}  // namespace kiln
