// Two-sided sheets: pairs of opposite triangles, used in game assets for cloth, flags and leaves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Triangles with a twin: the same three corners in opposite order.
struct TwoSided {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// Twin of each triangle, or kNone. Empty if no triangle has a twin. If more than two triangles have the same
  /// corners, they have no twins.
  std::vector<std::uint32_t> twins;
  /// For each triangle, 1 if it is the back of its pair. All fronts of a sheet are on the same side of it: they
  /// continue the surface of unpaired triangles, or else have the orientation of the sheet's first triangle. Where
  /// sheets intersect, each is oriented separately.
  std::vector<std::uint8_t> backs;
  /// For each triangle, 1 if its sheet shares no edge with unpaired triangles.
  std::vector<std::uint8_t> has_only_pairs;

  bool empty() const { return twins.empty(); }
  /// \param welded  triangles triangles whose corners have equal indices for equal positions
  static TwoSided of(std::span<const Triangle> welded, std::size_t vertices);
  /// Two-sided sheets of a mesh, by position.
  static TwoSided of(const Mesh& mesh);
};

}  // namespace kiln
