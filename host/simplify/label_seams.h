// Turns borders between labels into seams, for code without support for labels.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// Splits the vertices where labels meet into copies of one label each. meshoptimizer treats such borders as seams:
/// their vertices only move along the border, with both sides together.
class LabelSeams {
 public:
  /// \param triangles  [in, out] corners are replaced by the copies
  /// \param positions  [in, out] positions of the copies are appended
  LabelSeams(const std::vector<std::uint32_t>& labels, std::vector<Triangle>& triangles,
             std::vector<Vec3>& positions);

  /// True if the copies are few enough for a large reduction. If labels meet nearly everywhere, hardly any vertex
  /// could be removed.
  bool is_worthwhile() const {
    return origin_.size() - original_vertex_count_ <= original_vertex_count_ / kMinVerticesPerCopy;
  }

  /// Stores the labels of the remaining triangles, and restores their original vertices.
  void join(std::vector<Triangle>& triangles);
  /// Stores the labels of triangles with original vertices.
  void add(const std::vector<Triangle>& triangles, const std::vector<std::uint32_t>& labels);
  /// Labels of triangles that join() or add() stored; they may come in any order.
  /// \param origin  by vertex of `triangles`, the original vertex
  std::vector<std::uint32_t> of(const std::vector<Triangle>& triangles,
                                const std::vector<std::uint32_t>& origin);

 private:
  static constexpr std::size_t kMinVerticesPerCopy = 4;
  using StoredLabel = std::pair<Triangle, std::uint32_t>;

  std::size_t original_vertex_count_;
  std::vector<std::uint32_t> origin_, label_;  ///< Original vertex, and label, of each vertex
  std::vector<StoredLabel> stored_labels_;
};

}  // namespace kiln
