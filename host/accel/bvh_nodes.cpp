#include "accel/bvh_nodes.h"

#include <memory>
#include <utility>

#include "accel/bvh_prisms.h"
#include "base/parallel.h"

namespace kiln::bvh {

std::size_t TreeParts::node_count() const {
  std::size_t count = top.nodes.size();
  for (const Subtree& subtree : subtrees) count += subtree.nodes.size();
  return count;
}

std::size_t TreeParts::block_count() const {
  std::size_t count = top.blocks.size();
  for (const Subtree& subtree : subtrees) count += subtree.blocks.size();
  return count;
}

std::uint32_t TreeParts::join(std::span<kiln_bvh_node> nodes, std::span<kiln_bvh_block> blocks) {
  std::vector<std::size_t> first_node(tasks.size());
  std::vector<std::size_t> first_block(tasks.size());
  std::size_t node_end = top.nodes.size(), block_end = top.blocks.size();
  std::uint32_t depth = top.depth;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    first_node[i] = node_end;
    first_block[i] = block_end;
    node_end += subtrees[i].nodes.size();
    block_end += subtrees[i].blocks.size();
    depth = std::max(depth, subtrees[i].depth);
    top.nodes[tasks[i].node].child[tasks[i].child] = static_cast<std::uint32_t>(first_node[i]);
  }
  std::copy(top.nodes.begin(), top.nodes.end(), nodes.begin());
  std::copy(top.blocks.begin(), top.blocks.end(), blocks.begin());
  parallel_for(tasks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Subtree subtree = std::move(subtrees[i]);
      std::copy(subtree.blocks.begin(), subtree.blocks.end(), blocks.data() + first_block[i]);
      kiln_bvh_node* out = nodes.data() + first_node[i];
      for (const kiln_bvh_node& node : subtree.nodes) {
        *out = node;
        for (int c = 0; c < KILN_BVH_WIDTH; ++c) {
          const bool leaf = (node.child[c] & KILN_BVH_LEAF) != 0;
          out->child[c] += static_cast<std::uint32_t>(leaf ? first_block[i] : first_node[i]);
        }
        ++out;
      }
    }
  });
  return depth;
}

Bvh join_parts(TreeParts parts) {
  Bvh bvh;
  bvh.triangles = parts.triangles;
  bvh.skipped = parts.skipped;
  bvh.duplicates = parts.duplicates;
  bvh.leaves_per_line = parts.leaves_per_line;
  bvh.node_count = parts.node_count();
  bvh.block_count = parts.block_count();
  bvh.node_data = std::make_unique_for_overwrite<kiln_bvh_node[]>(bvh.node_count);
  bvh.block_data = std::make_unique_for_overwrite<kiln_bvh_block[]>(bvh.block_count);
  bvh.depth =
      parts.join({bvh.node_data.get(), bvh.node_count}, {bvh.block_data.get(), bvh.block_count});
  if (parts.has_crowded_nodes) add_prisms(bvh);
  return bvh;
}

}  // namespace kiln::bvh
