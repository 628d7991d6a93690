// A coarse proxy of a surface, for choosing charts. Each of its triangles represents a connected piece of the finer
// surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// A proxy is built by edge collapses in the order of their quadric errors. When a triangle vanishes, its piece of the
/// finer surface is added to that of a neighbour. So pieces are discs. For each edge between two proxy triangles, the
/// border of their pieces contains exactly one finer edge that represents it. The remaining edges on borders of pieces
/// form a tree around each vertex of the proxy. If each tree is contracted to a point, both surfaces have the same
/// topology.
struct ChartProxy {
  ChartSurface surface;
  /// For each triangle of the finer surface, the proxy triangle it belongs to
  std::vector<std::uint32_t> piece;
  /// For each half-edge of the proxy, the half-edge of the finer surface that represents it
  std::vector<std::uint32_t> surface_edge;
  /// 1 for each half-edge of the finer surface between two triangles of one piece
  std::vector<std::uint8_t> is_inside_piece;
};

/// Fans of triangles around vertices. A vertex at which several fans meet is split: each fan counts as one vertex.
struct VertexFans {
  explicit VertexFans(const ChartSurface& surface);

  std::vector<std::uint32_t> of;  ///< For each half-edge, the index of the fan at its start
  std::vector<std::uint32_t>
      first;  ///< A half-edge of each fan; at a border, the one without a mate
};

/// \param triangles  target number of triangles; small components keep all of theirs
ChartProxy chart_proxy(const ChartSurface& surface, const VertexFans& fans, std::size_t triangles);

}  // namespace kiln
