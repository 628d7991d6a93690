// Hard-surface scenes for tests: their connected parts, and what outside views show of them at each sample.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "kiln/kiln.h"
#include "measure/assess_samples.h"

namespace kiln::test {

/// The connected part of each triangle, named by a vertex of it: triangles that share a place are of one.
std::vector<std::uint32_t> parts_of(const Mesh& mesh);

/// A bake whose correspondence is kept, and its samples on both surfaces.
struct HardBake {
  HardBake(const Source& source, const Mesh& low, BakeOptions options);
  BakeResult baked;
  AssessedSamples samples;
  /// The sample's triangle on the high poly
  std::uint32_t triangle(std::size_t i) const { return baked.match->triangle[samples.element[i]]; }
};

/// The surface that outside views show at each sample's place, by part of the high poly: over 512 directions spread
/// evenly, those that see the place past the low poly, each by its cosine to the face of the low poly. A view shows
/// the first face of the high poly along its line, where that lies within `reach` of the place.
class Shown {
 public:
  /// \param reach  frame units
  Shown(const Source& source, const Mesh& high, const Mesh& low, const HardBake& bake, float reach);

  /// True if any direction sees the place of sample `i`, and something there.
  bool seen(std::size_t i) const { return sum_[i] > 0; }
  /// The share of it that is of a triangle's part; 0 for no triangle.
  double share(std::size_t i, std::uint32_t triangle) const;

 private:
  std::vector<std::uint32_t> parts_;
  std::vector<double> sum_;
  std::vector<std::map<std::uint32_t, double>> by_part_;
};

}  // namespace kiln::test
