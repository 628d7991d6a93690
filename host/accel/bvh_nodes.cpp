#include "accel/bvh_nodes.h"

#include <memory>

#include "base/parallel.h"

namespace kiln::bvh {

void join_subtrees(Subtree& top, const std::vector<Task>& tasks,
                   const std::vector<Subtree>& subtrees, Bvh& bvh) {
  std::vector<std::size_t> first_node(tasks.size());
  std::vector<std::size_t> first_block(tasks.size());
  bvh.node_count = top.nodes.size();
  bvh.block_count = top.blocks.size();
  bvh.depth = top.depth;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    first_node[i] = bvh.node_count;
    first_block[i] = bvh.block_count;
    bvh.node_count += subtrees[i].nodes.size();
    bvh.block_count += subtrees[i].blocks.size();
    bvh.depth = std::max(bvh.depth, subtrees[i].depth);
    top.nodes[tasks[i].node].child[tasks[i].child] = static_cast<std::uint32_t>(first_node[i]);
  }
  bvh.node_data = std::make_unique_for_overwrite<kiln_bvh_node[]>(bvh.node_count);
  bvh.block_data = std::make_unique_for_overwrite<kiln_bvh_block[]>(bvh.block_count);
  std::copy(top.nodes.begin(), top.nodes.end(), bvh.node_data.get());
  std::copy(top.blocks.begin(), top.blocks.end(), bvh.block_data.get());
  parallel_for(tasks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Subtree& subtree = subtrees[i];
      std::copy(subtree.blocks.begin(), subtree.blocks.end(),
                bvh.block_data.get() + first_block[i]);
      kiln_bvh_node* out = bvh.node_data.get() + first_node[i];
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
}

}  // namespace kiln::bvh
