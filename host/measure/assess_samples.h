// Samples of a match on the host: their points on the low poly and on the high poly.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/vector.h"
#include "source/high_poly.h"

namespace kiln {

struct AssessedSamples {
  std::vector<std::size_t> element;     ///< Index of the sample in the match's grid
  std::vector<std::uint32_t> triangle;  ///< Triangle of the low poly
  std::vector<Vec3> position;           ///< The sample's point p, frame units
  std::vector<Vec3> normal;             ///< Unit normal of the low poly's triangle
  /// Area of the low poly that the sample represents, square frame units
  std::vector<double> area;
  std::vector<std::uint8_t> found;  ///< 1 for samples with a match, 0 for misses
  std::vector<Vec3d> match;         ///< F(p), the matched point, frame units; 0 for a miss
  /// Unit normal of the high poly's triangle; 0 for triangles without area
  std::vector<Vec3> match_normal;

  std::size_t size() const { return element.size(); }
};

/// \throws Error(input) if the match does not fit the meshes
AssessedSamples assessed_samples(const Source::Impl& source, const Mesh& low, const Match& match);

}  // namespace kiln
