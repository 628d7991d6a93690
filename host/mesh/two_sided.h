// Two-sided sheets: triangles back to back, as game assets have them for cloth, flags and leaves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Which triangles have a twin: the same three corners, the other way round.
struct TwoSided {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// By triangle, its twin, or kNone. Empty: none has any. Where more than two have the same corners, none of them.
  std::vector<std::uint32_t> twins;
  /// By triangle, whether it is the back of its pair. Fronts that share an edge look to one side of their sheet: as the
  /// surface goes on without pairs, or else as the sheet's first triangle. Where sheets cross, each starts anew.
  std::vector<std::uint8_t> backs;
  /// By triangle, whether it is of a sheet by itself: the surface does not go on without pairs at an edge.
  std::vector<std::uint8_t> alone;

  bool empty() const { return twins.empty(); }
  /// \param welded  triangles whose corners are equal where their positions are
  static TwoSided of(std::span<const Triangle> welded, std::size_t vertices);
  /// Two-sided sheets of a mesh, corners welded.
  static TwoSided of(const Mesh& mesh);
};

}  // namespace kiln
