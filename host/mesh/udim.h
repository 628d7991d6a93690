// Tiles of UV space and their UDIM numbers.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace kiln {

inline constexpr std::uint32_t kFirstUdim = 1001, kUdimColumns = 10, kUdimRows = 900;

/// UDIM number of the tile that contains a point: 1001 + u + 10 v, with u and v rounded down. 0 if the point lies
/// outside of all tiles, or is not finite.
inline std::uint32_t udim_of(double u, double v) {
  if (!(u >= 0 && u < kUdimColumns && v >= 0 && v < kUdimRows)) return 0;
  return kFirstUdim + static_cast<std::uint32_t>(u) + kUdimColumns * static_cast<std::uint32_t>(v);
}

/// Lower left corner of a tile in UV space.
inline std::array<double, 2> udim_corner(std::uint32_t tile) {
  const std::uint32_t tile_index = tile - kFirstUdim;
  return {static_cast<double>(tile_index % kUdimColumns),
          static_cast<double>(tile_index / kUdimColumns)};
}

}  // namespace kiln
