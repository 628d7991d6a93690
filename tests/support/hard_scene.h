// Helpers for tests with hard-surface scenes: connected parts, and what views from outside show of them at each sample.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "kiln/bake.h"
#include "measure/assess_samples.h"

namespace kiln::test {

/// The connected part of each triangle, identified by one of its vertices. Triangles that share a position belong to
/// one part.
std::vector<std::uint32_t> parts_of(const Mesh& mesh);

/// A bake with its correspondence, and its samples on both surfaces.
struct HardBake {
  HardBake(const Source& source, const Mesh& low, BakeOptions options);
  BakeResult baked;
  AssessedSamples samples;
  /// The high poly's triangle that a sample matched
  std::uint32_t triangle(std::size_t i) const { return baked.match->triangle[samples.element[i]]; }
};

/// Which part of the high poly views from outside show at each sample. Of 512 directions, evenly distributed, those
/// count from which the low poly does not hide the sample, weighted by the cosine to the low poly's face. A view shows
/// the first face of the high poly along its line, if that face lies within `reach` of the sample.
class VisibleParts {
 public:
  /// Computes the shares of all samples. \param reach  search distance in frame units
  VisibleParts(const Source& source, const Mesh& high, const Mesh& low, const HardBake& bake,
               float reach);

  /// True if from any direction the sample is visible and the high poly has a face there.
  bool seen(std::size_t i) const { return sum_[i] > 0; }
  /// The share of views that show the part of a triangle; 0 for no triangle.
  double share(std::size_t i, std::uint32_t triangle) const;

 private:
  std::vector<std::uint32_t> parts_;
  std::vector<double> sum_;
  std::vector<std::map<std::uint32_t, double>> by_part_;
};

}  // namespace kiln::test
