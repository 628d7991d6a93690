// Which way triangles face within their parts, and turning them round.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kiln/mesh.h"

namespace kiln {

/// Parts, which edges of exactly two triangles connect, and how triangles face within them.
struct FacingParts {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Part {
    std::uint32_t first = 0;      ///< Its lowest triangle
    std::uint32_t triangles = 0;  ///< Number of triangles
    bool closed = true;           ///< Every edge is shared by two
    bool agrees = true;           ///< All face as the first one
    bool one_sided = false;       ///< No sides can be told apart, as of a Möbius strip
  };
  std::vector<Part> parts;
  std::vector<std::uint32_t> of;   ///< Part of a triangle
  std::vector<std::uint8_t> side;  ///< 0: it faces as the part's first triangle; 1: the other way

  /// \param triangles  whose corners are equal where their positions are
  FacingParts(std::span<const Triangle> triangles, std::size_t vertices);
};

/// Triangles on the wrong side of each part that disagrees: the side with less area; if the sides of a closed one are nearly alike, the side that
/// makes it face inwards.
std::vector<std::uint8_t> wrong_sides(const Mesh& mesh, const FacingParts& parts);

/// Turns triangles round, and their own normals with them where they faced as the triangles did.
/// \param turned  by triangle
TurnedTriangles turn_triangles(Mesh& mesh, std::span<const std::uint8_t> turned);

}  // namespace kiln
