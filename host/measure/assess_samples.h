// The samples of a match, on the host: where each lies on the low poly and on the high poly.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/bake.h"
#include "mesh/vector.h"
#include "source/high_poly.h"

namespace kiln {

struct AssessedSamples {
  std::vector<std::size_t> element;     ///< Element of the match's grid
  std::vector<std::uint32_t> triangle;  ///< Triangle of the low poly
  std::vector<Vec3> position;           ///< p, frame units
  std::vector<Vec3> normal;             ///< Unit, of the low poly's triangle
  std::vector<double> area;  ///< Area of the low poly that the sample stands for, frame units
  std::vector<std::uint8_t> found;  ///< 0: missed
  std::vector<Vec3d> match;         ///< F(p), frame units; 0 where missed
  std::vector<Vec3> match_normal;   ///< Unit, of the high poly's triangle; 0 where it has no area

  std::size_t size() const { return element.size(); }
};

/// \throws Error(input) where the match does not fit
AssessedSamples assessed_samples(const Source::Impl& source, const Mesh& low, const Match& match);

}  // namespace kiln
