// Width of vertex indices.
#pragma once

#include <cstdint>
#include <limits>

namespace kiln {

/// True if 16 bits can hold every index of a primitive with this many vertices. Index 65535 restarts primitives, so it
/// must not be the index of a vertex.
constexpr bool fits_16_bit_indices(std::uint64_t vertices) {
  return vertices <= std::numeric_limits<std::uint16_t>::max();
}

}  // namespace kiln
