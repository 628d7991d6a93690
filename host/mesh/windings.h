// Makes the orientation of triangles consistent within connected parts.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// The parts of a mesh (connected over edges of exactly two triangles), and the orientation of triangles within them.
struct FacingParts {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Part {
    std::uint32_t first = 0;      ///< Lowest triangle of the part
    std::uint32_t triangles = 0;  ///< Number of triangles
    bool closed = true;           ///< True if every edge has two triangles
    bool is_consistent = true;    ///< True if all triangles are oriented as the first one
    bool one_sided = false;       ///< True if the part is not orientable, such as a Möbius strip
  };
  std::vector<Part> parts;
  std::vector<std::uint32_t> of;  ///< Part of each triangle
  /// For each triangle, 1 if its orientation is opposite to that of the part's first triangle
  std::vector<std::uint8_t> side;

  /// \param triangles  triangles whose corners have equal indices for equal positions
  FacingParts(std::span<const Triangle> triangles, std::size_t vertices);
};

/// For each triangle, 1 if it must be reversed to make its part consistent. In each inconsistent part, this is the
/// group of equally oriented triangles with less area; if both groups of a closed part are about equal, the group that
/// makes the part face inwards.
std::vector<std::uint8_t> wrong_sides(const Mesh& mesh, const FacingParts& parts);

/// Reverses triangles, and those of their corner normals that pointed to the front of the triangle.
/// \param turned  for each triangle, 1 if it is to be reversed
TurnedTriangles turn_triangles(Mesh& mesh, std::span<const std::uint8_t> turned);

}  // namespace kiln
