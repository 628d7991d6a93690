// Two-sided sheets: pairs of opposite triangles, as game assets have for cloth, flags and leaves.
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

  /// By triangle, its twin, or kNone. Empty if no triangle has one. More than two triangles of the same corners have
  /// none.
  std::vector<std::uint32_t> twins;
  /// By triangle, 1 if it is the back of its pair. Fronts that share an edge face one side of their sheet: they
  /// continue the surface of unpaired triangles, or else follow the sheet's first triangle. Where sheets intersect,
  /// each is oriented separately.
  std::vector<std::uint8_t> backs;
  /// By triangle, 1 if its sheet shares no edge with unpaired triangles.
  std::vector<std::uint8_t> alone;

  bool empty() const { return twins.empty(); }
  /// \param welded  triangles with equal indices for equal positions
  static TwoSided of(std::span<const Triangle> welded, std::size_t vertices);
  /// Two-sided sheets of a mesh, by position.
  static TwoSided of(const Mesh& mesh);
};

}  // namespace kiln
