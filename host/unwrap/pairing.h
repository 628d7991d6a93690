// Pairs of triangles that share an edge, chosen so that each pair unfolds to almost a rectangle.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/half_edge.h"
#include "mesh/triangle_shape.h"

namespace kiln {

/// For every triangle its partner, and its own corner that is opposite the shared edge.
struct Pairing {
  std::vector<std::uint32_t> partner;  ///< Index of the other triangle, or kNoIndex.
  std::vector<std::uint8_t> apex;      ///< 0, 1 or 2; meaningful where there is a partner.
  std::uint64_t pairs = 0;
};

/// A right triangle with legs `width` and `height` in the texture is mapped to a surface triangle. How far
/// that is from keeping lengths: the mean over the axes of the squared logarithm of the singular values. 0: none. `leg_u` and `leg_v` are the squared lengths of the surface's legs, `hypotenuse`
/// that of its third side.
double stretch(double width, double height, double leg_u, double leg_v, double hypotenuse);

/// Pairs triangles greedily, least stretched first, then lengthens alternating paths so that few stay
/// single. Only triangles of positive area that run along the shared edge in opposite senses (a
/// consistent orientation) are paired. No pair's stretch exceeds a limit: such triangles are better off
/// single. Vertices at exactly the same position count as one. Deterministic.
/// Cost: n log n; about 1 s for a million triangles.
Pairing pair_triangles(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                       std::span<const TriangleShape> shapes);

}  // namespace kiln
