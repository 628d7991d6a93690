// Turns borders between labels into seams, for code that does not know labels.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "kiln/types.h"
#include "mesh/vector.h"

namespace kiln {

/// Splits each vertex at which labels meet into one copy per label. meshoptimizer then treats these borders as seams:
/// their vertices only move along the border, and both sides move together.
class LabelSeams {
 public:
  /// \param triangles  [in, out] corners at split vertices are replaced by the copies
  /// \param positions  [in, out] the positions of the copies are appended
  LabelSeams(const std::vector<std::uint32_t>& labels, std::vector<Triangle>& triangles,
             std::vector<Vec3>& positions);

  /// True if the copies are few enough for a large reduction. If labels meet nearly everywhere, hardly any vertex could
  /// be removed.
  bool is_worthwhile() const {
    return origin_.size() - original_vertex_count_ <= original_vertex_count_ / kMinVerticesPerCopy;
  }

  /// Stores the labels of the remaining triangles, and replaces copies of vertices by the originals.
  void merge_copies(std::vector<Triangle>& triangles);
  /// Stores the labels of triangles over the original vertices.
  void store_labels(const std::vector<Triangle>& triangles,
                    const std::vector<std::uint32_t>& labels);
  /// The labels of triangles that merge_copies() or store_labels() stored. The triangles may come in any order.
  /// \param origin  for each vertex of `triangles`, the original vertex
  std::vector<std::uint32_t> labels_of(const std::vector<Triangle>& triangles,
                                       const std::vector<std::uint32_t>& origin);

 private:
  static constexpr std::size_t kMinVerticesPerCopy = 4;
  using StoredLabel = std::pair<Triangle, std::uint32_t>;

  std::size_t original_vertex_count_;
  std::vector<std::uint32_t> origin_, label_;  ///< Original vertex, and label, of each vertex
  std::vector<StoredLabel> stored_labels_;
};

}  // namespace kiln
