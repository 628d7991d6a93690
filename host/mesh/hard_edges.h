// Hard edges of a low poly: edges at which the normals of adjacent faces differ.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

/// Edges of two or more faces whose normals differ by more than half a degree at one or both vertices. Faces are
/// adjacent if their corners have exactly equal positions. Unusable triangles have no edges.
struct HardEdges {
  struct Edge {
    /// `from` is the position of the first vertex; the second vertex is at from + along
    Vec3 from, along;
    std::array<std::uint32_t, 2> faces{};  ///< The first two triangles at the edge
  };
  std::vector<Edge> edges;  ///< Without edges of length 0

  static HardEdges of(const LowSurface& surface);

  /// For each triangle, the edges that may be nearer to one of its points than their widths. The lists may also contain
  /// edges that are farther away.
  /// \param widths  width of each edge
  struct EdgesOfTriangles {
    /// For each triangle, its first element of `edge`; one extra entry at the end
    std::vector<std::uint32_t> first;
    std::vector<std::uint32_t> edge;
  };
  EdgesOfTriangles find_near(const LowSurface& surface, std::span<const float> widths) const;
};

}  // namespace kiln
