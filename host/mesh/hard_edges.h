// Hard edges: where the normals of a low poly's faces part.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/low_surface.h"

namespace kiln {

/// Edges that two or more faces share. At one end at least, two of their normals part by more than half a
/// degree. Faces meet where their corners lie in exactly the same place. Faces that are not usable have none.
struct HardEdges {
  struct Edge {
    Vec3 from, along;                      ///< The other end is from + along
    std::array<std::uint32_t, 2> faces{};  ///< Two triangles that share it: the first two in order
  };
  std::vector<Edge> edges;  ///< Without length: none

  static HardEdges of(const LowSurface& surface);

  /// Edges that may come nearer to points of each triangle than their widths; some may not.
  /// \param widths  of each edge
  struct Near {
    std::vector<std::uint32_t> first;  ///< Per triangle its first element of `edge`, and the end
    std::vector<std::uint32_t> edge;
  };
  Near near(const LowSurface& surface, std::span<const float> widths) const;
};

}  // namespace kiln
