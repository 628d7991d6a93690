// Two-sided sheets: pairs of opposite triangles, which game assets use for cloth, flags and leaves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Which triangles have a twin: a triangle with the same three corners in opposite order.
struct TwoSided {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// Twin of each triangle, or kNone. Empty if no triangle has a twin. If more than two triangles have the same three
  /// corners, none of them has a twin.
  std::vector<std::uint32_t> twins;
  /// For each triangle, 1 if it is the back of a pair. All fronts of a sheet are on the same side of it: they continue
  /// the surface of triangles without twins, or else have the orientation of the sheet's first triangle. Where sheets
  /// intersect, each is oriented separately.
  std::vector<std::uint8_t> backs;
  /// For each triangle, 1 if its sheet shares no edge with triangles without twins.
  std::vector<std::uint8_t> has_only_pairs;

  bool empty() const { return twins.empty(); }
  /// \param welded  triangles whose corners have equal indices for equal positions
  static TwoSided of(std::span<const Triangle> welded, std::size_t vertices);
  /// Finds the two-sided sheets of a mesh by the positions of its vertices.
  static TwoSided of(const Mesh& mesh);
};

}  // namespace kiln
