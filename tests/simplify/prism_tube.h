// The sides of a prism.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "kiln/mesh.h"

namespace kiln::test {

/// Open at both ends, of radius 0.5 and height 1; each side has 2 * 8 * 24 triangles. No normals.
inline Mesh prism_tube(std::uint32_t sides) {
  constexpr std::uint32_t kColumns = 8, kRows = 24;
  const std::uint32_t around = sides * kColumns;
  const auto corner = [&](std::uint32_t side) {
    const double a = 2 * std::numbers::pi * side / sides;
    return Vec2{static_cast<float>(0.5 * std::cos(a)), static_cast<float>(0.5 * std::sin(a))};
  };
  Mesh tube;
  for (std::uint32_t row = 0; row <= kRows; ++row) {
    for (std::uint32_t i = 0; i < around; ++i) {
      const Vec2 a = corner(i / kColumns), b = corner(i / kColumns + 1);
      const float share = static_cast<float>(i % kColumns) / kColumns;
      tube.positions.push_back(
          {a.x + (b.x - a.x) * share, a.y + (b.y - a.y) * share, static_cast<float>(row) / kRows});
      if (row == kRows) continue;
      const std::uint32_t at = row * around + i, next = row * around + (i + 1) % around;
      tube.triangles.push_back({at, next, next + around});
      tube.triangles.push_back({at, next + around, at + around});
    }
  }
  return tube;
}

}  // namespace kiln::test
