// Half-edges of an indexed triangle list: half-edge 3 t + k runs from corner k of triangle t to the next corner.
#pragma once

#include <cstdint>
#include <limits>

namespace kiln {

/// Index that stands for a missing triangle or half-edge.
inline constexpr std::uint32_t kNoIndex = std::numeric_limits<std::uint32_t>::max();

inline std::uint32_t next_half_edge(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline std::uint32_t previous_half_edge(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

}  // namespace kiln
