// A coarse proxy of a surface, for choosing charts. Each of its triangles represents a connected piece of the finer
// surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// Proxies are built by edge collapses in the order of quadric errors. When a triangle vanishes, a neighbour gets its
/// piece. So pieces are discs, and the border between two of them contains exactly one edge of the finer surface that
/// represents the proxy's edge; the remaining border edges form a tree around each vertex of the proxy. If each tree
/// is contracted to a point, both surfaces have the same topology.
struct ChartProxy {
  ChartSurface surface;
  std::vector<std::uint32_t> piece;  ///< The proxy's triangle of each finer triangle
  /// The finer half-edge that represents each half-edge of the proxy
  std::vector<std::uint32_t> surface_edge;
  std::vector<std::uint8_t>
      is_inside_piece;  ///< 1 for each finer half-edge between triangles of one piece
};

/// Fans of triangles around vertices. A vertex at which several fans meet counts once for each fan.
struct VertexFans {
  explicit VertexFans(const ChartSurface& surface);

  std::vector<std::uint32_t> of;  ///< Index of the fan at the start of each half-edge
  std::vector<std::uint32_t>
      first;  ///< A half-edge of each fan; at a border, the one without a mate
};

/// \param triangles  target number; small components keep all their triangles
ChartProxy chart_proxy(const ChartSurface& surface, const VertexFans& fans, std::size_t triangles);

}  // namespace kiln
