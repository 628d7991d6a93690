// Pairs triangles that share an edge. Each pair unfolds to nearly a rectangle.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/half_edge.h"
#include "mesh/triangle_shape.h"

namespace kiln {

/// The partner of each triangle, and the triangle's corner opposite the edge they share.
struct Pairing {
  std::vector<std::uint32_t> partner;  ///< Index of the other triangle, or kNoIndex
  /// Corner opposite the shared edge: 0, 1 or 2; undefined for triangles without a partner
  std::vector<std::uint8_t> apex;
  std::uint64_t pairs = 0;
};

/// Stretch of the affine map from a right triangle in the texture, with legs `width` and `height`, to a triangle on the
/// surface: the mean of the squared logarithms of the two singular values. An isometry has a stretch of 0. `leg_u` and
/// `leg_v` are the squared lengths of the surface triangle's legs, `hypotenuse` that of its third side.
double stretch(double width, double height, double leg_u, double leg_v, double hypotenuse);

/// Pairs triangles greedily, those with the least stretch first. Then extends the matching along alternating paths, so
/// that few triangles remain single. Two triangles are only paired if both have a positive area and run along the
/// shared edge in opposite directions (consistent orientation). A limit on the stretch leaves triangles single where no
/// good partner exists. Vertices at exactly the same position count as one. Deterministic. Cost: n log n; about 1 s for
/// a million triangles.
Pairing pair_triangles(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                       std::span<const TriangleShape> shapes);

}  // namespace kiln
