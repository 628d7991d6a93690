// Hard edges of a low poly, where the normals of adjacent faces differ.
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
    /// Position of the first vertex; the second one is at from + along
    Vec3 from, along;
    std::array<std::uint32_t, 2> faces{};  ///< The first two triangles at the edge
  };
  std::vector<Edge> edges;  ///< Edges of length 0 are left out

  static HardEdges of(const LowSurface& surface);

  /// Edges that may be nearer to points of a triangle than their widths (a conservative list).
  /// \param widths  width of each edge
  struct Near {
    /// First element of `edge` for each triangle; one extra entry
    std::vector<std::uint32_t> first;
    std::vector<std::uint32_t> edge;
  };
  Near near(const LowSurface& surface, std::span<const float> widths) const;
};

}  // namespace kiln
