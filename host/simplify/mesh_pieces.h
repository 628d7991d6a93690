// Splits a mesh into pieces that several threads can process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// Splits a mesh into pieces: halves it across its longest side, recursively, as long as every piece keeps at least
/// `least` triangles.
/// \returns for each piece, its triangles in ascending order. Depends on the mesh alone.
std::vector<std::vector<std::uint32_t>> pieces_of(std::span<const Vec3> positions,
                                                  std::span<const Triangle> triangles,
                                                  std::size_t least);

/// For each vertex, 1 if triangles of several pieces meet at it, else 0.
std::vector<std::uint8_t> vertices_between_pieces(
    const std::vector<std::vector<std::uint32_t>>& pieces, std::span<const Triangle> triangles,
    std::size_t vertices);

}  // namespace kiln
