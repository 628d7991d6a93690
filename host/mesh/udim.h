// Squares of UV space by their UDIM numbers.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace kiln {

inline constexpr std::uint32_t kFirstUdim = 1001, kUdimColumns = 10, kUdimRows = 900;

/// The number of the square with a place, 1001 + u + 10 v; 0: it has none, or the place is not finite.
inline std::uint32_t udim_of(double u, double v) {
  if (!(u >= 0 && u < kUdimColumns && v >= 0 && v < kUdimRows)) return 0;
  return kFirstUdim + static_cast<std::uint32_t>(u) + kUdimColumns * static_cast<std::uint32_t>(v);
}

/// Its lower left corner.
inline std::array<double, 2> udim_corner(std::uint32_t tile) {
  const std::uint32_t place = tile - kFirstUdim;
  return {static_cast<double>(place % kUdimColumns), static_cast<double>(place / kUdimColumns)};
}

}  // namespace kiln
