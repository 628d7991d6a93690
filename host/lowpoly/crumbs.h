// Parts of a mesh that are too small to be seen.
#pragma once

#include <cstdint>
#include <vector>

#include "lowpoly/simplify_input.h"

namespace kiln {

/// The parts of a mesh, by shared vertices, and how large each is.
class PartSizes {
 public:
  explicit PartSizes(const Work& work);

  /// Parts whose box has a diagonal below `size`; never the largest.
  std::uint64_t count_below(double size) const;
  /// The mesh without them, its vertices renumbered.
  Work without(const Work& work, double size) const;

 private:
  bool is_below(std::uint32_t part, double size) const;

  std::vector<std::uint32_t> part_;  ///< Of each triangle.
  std::vector<double> diagonal_;     ///< Of each part's box.
  std::uint32_t largest_ = 0;
};

/// The mean edge of a mesh with this area and as many equilateral triangles.
double mean_edge(const Work& work, std::size_t faces);

}  // namespace kiln
