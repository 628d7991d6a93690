// Nodes as the BVH builder writes them: separate subtrees, and the tree that joins them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <vector>

#include "accel/bvh.h"
#include "accel/bvh_range.h"
#include "base/page_array.h"

namespace kiln::bvh {

/// A finished subtree, with indices relative to its own arrays.
struct Subtree {
  std::vector<kiln_bvh_node, PageAllocator<kiln_bvh_node>> nodes;
  std::vector<kiln_bvh_block, PageAllocator<kiln_bvh_block>> blocks;
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

/// A tree as separate parts, which build_bvh() joins.
struct TreeParts {
  Subtree top;
  std::vector<Task> tasks;  ///< The parent of each subtree
  std::vector<Subtree> subtrees;
  std::uint64_t triangles = 0, skipped = 0, duplicates = 0;  ///< Triangle counts, as in Bvh
  double leaves_per_line = 0;
  bool has_crowded_nodes = false;  ///< True if bounding prisms may be worthwhile

  std::size_t node_count() const;
  std::size_t block_count() const;
  /// Joins the top and the subtrees, in order. Each part is freed as soon as it is copied, so that a large tree is not in
  /// memory twice. \param nodes, blocks  of node_count() and block_count() elements \returns the tree's depth
  std::uint32_t join(std::span<kiln_bvh_node> nodes, std::span<kiln_bvh_block> blocks);
};

/// Builds the parts of a tree without joining them. \param merge  as for build_bvh()
TreeParts build_parts(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                      bool merge);

/// Joins the parts to a tree, and adds bounding prisms if they are worthwhile.
Bvh join_parts(TreeParts parts);

}  // namespace kiln::bvh
