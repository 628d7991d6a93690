// Splits a mesh into pieces for several threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// Splits a mesh into pieces: halves it across its longest side, recursively, while all pieces keep at least `least`
/// triangles.
/// \returns the triangles of each piece, in ascending order. Depends on the mesh alone.
std::vector<std::vector<std::uint32_t>> pieces_of(std::span<const Vec3> positions,
                                                  std::span<const Triangle> triangles,
                                                  std::size_t least);

/// By vertex, 1 where triangles of several pieces meet, else 0.
std::vector<std::uint8_t> vertices_between_pieces(
    const std::vector<std::vector<std::uint32_t>>& pieces, std::span<const Triangle> triangles,
    std::size_t vertices);

}  // namespace kiln
