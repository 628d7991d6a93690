// Pairs triangles that share an edge such that each pair unfolds to nearly a rectangle.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/half_edge.h"
#include "mesh/triangle_shape.h"

namespace kiln {

/// The partner of each triangle, and the triangle's corner opposite the shared edge.
struct Pairing {
  std::vector<std::uint32_t> partner;  ///< Index of the other triangle, or kNoIndex
  /// Corner opposite the shared edge: 0, 1 or 2; undefined without a partner
  std::vector<std::uint8_t> apex;
  std::uint64_t pairs = 0;
};

/// Stretch of the map from a right triangle with legs `width` and `height` in the texture to a surface triangle: the
/// mean over both axes of the squared logarithm of the singular values. The stretch of an isometry is 0. `leg_u` and
/// `leg_v` are the squared lengths of the surface's legs, `hypotenuse` that of its third side.
double stretch(double width, double height, double leg_u, double leg_v, double hypotenuse);

/// Pairs triangles greedily, the least stretched first, then extends the matching along alternating paths, so that
/// few triangles remain single. Only triangles of positive area that run along the shared edge in opposite directions
/// (a consistent orientation) are paired. No pair's stretch exceeds a limit, beyond which single triangles are
/// better. Vertices at exactly the same position count as one. Deterministic. Cost: n log n; about 1 s for a million
/// triangles.
Pairing pair_triangles(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                       std::span<const TriangleShape> shapes);

}  // namespace kiln
