// Scan conversion by brute force: every sample against every triangle.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kiln::test {

struct ReferenceUv {
  float u, v;
};
using ReferenceTriangle = std::array<ReferenceUv, 3>;

struct ReferenceSample {
  std::int64_t triangle = -1;  ///< Lowest index that covers the sample, -1: none
  int covering = 0;            ///< How many triangles cover it
  double u = 0, v = 0;         ///< Weights of corners 1 and 2, of the snapped triangle
};

/// All samples of a map, [height * samples][width * samples], row 0 at v = 1.
///
/// Corners are snapped to a grid of 2^-bits samples, bits = 28 - ceil(log2(longer side in samples)).
/// A sample belongs to a triangle where its centre lies strictly inside, or on an edge that is a left
/// or top one: stated here as "the centre moved right by an infinitesimal, and down by a far smaller
/// one, is inside" (moving right decides for edges that are not horizontal, moving down for those).
/// UVs must lie in [-1, 2].
std::vector<ReferenceSample> reference_samples(const std::vector<ReferenceTriangle>& triangles,
                                               int width, int height, int samples);

}  // namespace kiln::test
