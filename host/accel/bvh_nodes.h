// Nodes written by the builder of the BVH: subtrees, and the tree that joins them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <vector>

#include "accel/bvh.h"
#include "accel/bvh_range.h"

namespace kiln::bvh {

/// A finished subtree, with indices relative to its own arrays.
struct Subtree {
  std::vector<kiln_bvh_node> nodes;
  std::vector<kiln_bvh_block> blocks;
  std::uint32_t depth = 0;
  double leaf_area = 0;             ///< Sum of the half areas of its leaves
  bool has_crowded_leaves = false;  ///< True if bounding prisms may be worthwhile in the subtree
};

/// A range whose subtree is still to be built.
struct Task {
  Range range;
  std::uint32_t level = 0;
  /// Parent of the subtree: a node of the top part of the tree (`child`: which of its children)
  std::size_t node = 0;
  int child = 0;
};

inline kiln_bvh_node empty_node() {
  kiln_bvh_node node;
  for (auto& axis : node.planes) {
    std::fill(std::begin(axis[0]), std::end(axis[0]), kInfinity);
    std::fill(std::begin(axis[1]), std::end(axis[1]), -kInfinity);
  }
  std::fill(std::begin(node.child), std::end(node.child), KILN_BVH_LEAF);
  std::fill(std::begin(node.pad), std::end(node.pad), 0u);
  return node;
}

inline void set_box(kiln_bvh_node& node, int child, const Box& box) {
  for (int axis = 0; axis < 3; ++axis) {
    node.planes[axis][0][child] = box.lo[axis] - KILN_BVH_EPSILON;
    node.planes[axis][1][child] = box.hi[axis] + KILN_BVH_EPSILON;
  }
}

/// Appends the subtrees to the top part of the tree, in order; `tasks` holds the parent of each subtree.
void join_subtrees(Subtree& top, const std::vector<Task>& tasks,
                   const std::vector<Subtree>& subtrees, Bvh& bvh);

}  // namespace kiln::bvh
