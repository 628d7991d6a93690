#include "simplify/label_seams.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>

#include "mesh/vertex_lists.h"

namespace kiln {

LabelSeams::LabelSeams(const std::vector<std::uint32_t>& labels, std::vector<Triangle>& triangles,
                       std::vector<Vec3>& positions)
    : original_vertex_count_(positions.size()),
      origin_(original_vertex_count_),
      label_(original_vertex_count_, 0) {
  std::iota(origin_.begin(), origin_.end(), 0U);
  const VertexLists corners(
      original_vertex_count_, 3 * triangles.size(),
      [&](std::size_t i) { return triangles[i / 3][i % 3]; },
      [&](std::size_t i) { return std::uint64_t{labels[i / 3]}; });
  for (std::uint32_t v = 0; v < original_vertex_count_; ++v) {
    const std::span<const VertexLists::Item> around = corners.of(v);
    std::uint32_t copy = v;
    for (std::size_t i = 0; i < around.size(); ++i) {
      const auto label = static_cast<std::uint32_t>(around[i].key);
      if (i == 0) {
        label_[v] = label;
      } else if (around[i].key != around[i - 1].key) {
        copy = static_cast<std::uint32_t>(origin_.size());
        origin_.push_back(v);
        label_.push_back(label);
        positions.push_back(Vec3(positions[v]));
      }
      triangles[around[i].index / 3][around[i].index % 3] = copy;
    }
  }
}

void LabelSeams::merge_copies(std::vector<Triangle>& triangles) {
  for (Triangle& t : triangles) {
    const std::uint32_t label = label_[t[0]];
    for (std::uint32_t& v : t) v = origin_[v];
    stored_labels_.emplace_back(lowest_first(t), label);
  }
}

void LabelSeams::store_labels(const std::vector<Triangle>& triangles,
                              const std::vector<std::uint32_t>& labels) {
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    stored_labels_.emplace_back(lowest_first(triangles[t]), labels[t]);
  }
}

std::vector<std::uint32_t> LabelSeams::labels_of(const std::vector<Triangle>& triangles,
                                                 const std::vector<std::uint32_t>& origin) {
  // The sort is stable, so of several equal triangles, the label of the first is kept.
  std::stable_sort(stored_labels_.begin(), stored_labels_.end(),
                   [](const StoredLabel& a, const StoredLabel& b) { return a.first < b.first; });
  std::vector<std::uint32_t> labels;
  labels.reserve(triangles.size());
  for (Triangle t : triangles) {
    for (std::uint32_t& v : t) v = origin[v];
    t = lowest_first(t);
    labels.push_back(
        std::lower_bound(stored_labels_.begin(), stored_labels_.end(), t,
                         [](const StoredLabel& a, const Triangle& b) { return a.first < b; })
            ->second);
  }
  return labels;
}

}  // namespace kiln
