// A surface in place of a finer one, for charts: few triangles, each for a piece of the finer surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lowpoly/chart_surface.h"

namespace kiln {

/// Its edges collapse to where their quadrics are least, the cheapest first. A triangle that vanishes leaves its
/// piece to a neighbour. So pieces are discs, and a curve between two of them is one edge of the finer surface. Around
/// each vertex of the proxy there is a tree of edges beside these. Where it is shrunk to a point, both surfaces are the
/// same.
struct ChartProxy {
  ChartSurface surface;
  std::vector<std::uint32_t> piece;  ///< Of each finer triangle: the proxy's triangle
  std::vector<std::uint32_t> curve;  ///< Of each half-edge of the proxy: the finer one
  std::vector<std::uint8_t>
      inside;  ///< Of each finer half-edge: whether it joins triangles of a piece
};

/// The fans of triangles around each vertex: a vertex where several meet is one for each.
struct VertexFans {
  explicit VertexFans(const ChartSurface& surface);

  std::vector<std::uint32_t> of;  ///< Of the start of each half-edge
  std::vector<std::uint32_t>
      first;  ///< Of each fan: a half-edge from it; at a border the one without a mate
};

/// \param triangles  to go for; parts that are small keep theirs
ChartProxy chart_proxy(const ChartSurface& surface, const VertexFans& fans, std::size_t triangles);

}  // namespace kiln
