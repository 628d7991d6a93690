// Borders between labels as seams, for what knows of no labels.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// A mesh whose vertices are parted where labels meet: copies at the same place, each of one label. meshoptimizer
/// takes such borders for seams, whose vertices only move along them, both sides together.
class LabelSeams {
 public:
  /// \param triangles  [in, out] their corners become copies
  /// \param positions  [in, out] those of the copies are added
  LabelSeams(const std::vector<std::uint32_t>& labels, std::vector<Triangle>& triangles,
             std::vector<Vec3>& positions);

  /// True if copies are so few that a mesh still goes far down: where labels meet nearly everywhere, all would stay.
  bool pays() const { return origin_.size() - vertices_ <= vertices_ / kMostCopies; }

  /// Takes note of the labels of what is left, and gives it the vertices that there were.
  void join(std::vector<Triangle>& triangles);
  /// Takes note of triangles with the vertices that there were.
  void add(const std::vector<Triangle>& triangles, const std::vector<std::uint32_t>& labels);
  /// Labels of triangles that were noted, in any order.
  /// \param origin  of each of their vertices, that which there was
  std::vector<std::uint32_t> of(const std::vector<Triangle>& triangles,
                                const std::vector<std::uint32_t>& origin);

 private:
  static constexpr std::size_t kMostCopies = 4;
  using Noted = std::pair<Triangle, std::uint32_t>;

  std::size_t vertices_;
  std::vector<std::uint32_t> origin_, label_;  ///< By vertex.
  std::vector<Noted> noted_;
};

}  // namespace kiln
