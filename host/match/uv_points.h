// Finds the points of the high poly at given UVs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "source/high_poly.h"

namespace kiln {

struct UvPoints {
  std::vector<std::uint32_t> triangle;  ///< KILN_NO_TRIANGLE for UVs that no triangle covers
  /// Two arrays, one after the other: weights of corner 1, then of corner 2
  std::vector<float> barycentric;
};

/// Finds the points that a match by UVs would find with a map of unlimited size: the lowest of the high
/// poly's triangles that cover a UV. Triangles without area in UV space, or not finite, cover nothing. UVs
/// are sorted into a grid, and each triangle is tested against the UVs in the cells under its box.
/// \pre the source has UVs, with valid indices
UvPoints find_uv_points(const Source::Impl& source, std::span<const Vec2> uvs);

}  // namespace kiln
