// A surface in place of a finer one, for charts: few triangles, each for a piece of the finer surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// Its edges collapse to where their quadrics are least, the cheapest first. A triangle that vanishes leaves its
/// piece to a neighbour. So pieces are discs, and a curve between two of them is one edge of the finer surface. Around
/// each vertex of the proxy there is a tree of edges beside these. Where it is shrunk to a point, both surfaces are the
/// same.
struct ChartProxy {
  ChartSurface surface;
  std::vector<std::uint32_t> piece;  ///< The proxy's triangle of each finer triangle
  std::vector<std::uint32_t> curve;  ///< The finer half-edge of each half-edge of the proxy
  std::vector<std::uint8_t> inside;  ///< Per finer half-edge: 1 if it joins triangles of a piece
};

/// The fans of triangles around each vertex: a vertex where several meet is one for each.
struct VertexFans {
  explicit VertexFans(const ChartSurface& surface);

  std::vector<std::uint32_t> of;  ///< Fan at the start of each half-edge
  std::vector<std::uint32_t>
      first;  ///< A half-edge of each fan; at a border the one without a mate
};

/// \param triangles  to go for; parts that are small keep theirs
ChartProxy chart_proxy(const ChartSurface& surface, const VertexFans& fans, std::size_t triangles);

}  // namespace kiln
