// Tests whether triangles are usable.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// True if a triangle is finite and has an area. In double precision, products of two differences of floats are
/// (nearly) exact, so parallel edges are detected.
inline bool has_area(std::span<const Vec3> positions, const Triangle& triangle) {
  for (const std::uint32_t corner : triangle) {
    if (!is_finite(positions[corner])) return false;
  }
  const Vec3d first = to_double(positions[triangle[0]]);
  const Vec3d a = to_double(positions[triangle[1]]) - first;
  const Vec3d b = to_double(positions[triangle[2]]) - first;
  return a.y * b.z != a.z * b.y || a.z * b.x != a.x * b.z || a.x * b.y != a.y * b.x;
}

/// True if a triangle with double-precision corners, as in files, is finite and has an area. False if its corners are
/// collinear within their rounding.
bool has_area(const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Number of degenerate and non-finite triangles.
std::uint64_t count_without_area(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles);

}  // namespace kiln
