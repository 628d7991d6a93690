// Width of vertex indices.
#pragma once

#include <cstdint>
#include <limits>

namespace kiln {

/// True if 16 bits hold every index of a primitive with so many vertices. The index 65535 restarts primitives, so no
/// vertex has it.
constexpr bool fits_16_bit_indices(std::uint64_t vertices) {
  return vertices <= std::numeric_limits<std::uint16_t>::max();
}

}  // namespace kiln
