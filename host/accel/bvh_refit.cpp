#include <vector>

#include "accel/bvh.h"
#include "accel/bvh_range.h"
#include "base/parallel.h"

namespace kiln {

using bvh::Box;

void refit_bvh(Bvh& bvh, std::span<const Vec3> positions, std::span<const Triangle> triangles) {
  std::vector<Box> leaf_boxes(bvh.block_count);
  parallel_for(bvh.block_count, 1 << 12, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      kiln_bvh_block& block = bvh.block_data[i];
      for (std::size_t lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
        const bool is_used = block.triangle[lane] != KILN_NO_TRIANGLE;
        const Triangle& triangle = triangles[block.triangle[is_used ? lane : 0]];
        for (std::size_t corner = 0; corner < 3; ++corner) {
          const Vec3& p = positions[triangle[is_used ? corner : 0]];
          block.corner[corner][0][lane] = p.x;
          block.corner[corner][1][lane] = p.y;
          block.corner[corner][2][lane] = p.z;
          leaf_boxes[i].include(Float4{p.x, p.y, p.z, 0});
        }
      }
    }
  });
  // A child's index is larger than its parent's. The union of widened boxes is the widened union.
  std::vector<Box> node_boxes(bvh.node_count);
  for (std::size_t i = bvh.node_count; i-- > 0;) {
    kiln_bvh_node& node = bvh.node_data[i];
    for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
      // Unused children keep their inverted bounds.
      if (node.planes[0][0][c] > node.planes[0][1][c]) continue;
      const std::uint32_t child = node.child[c];
      const bool leaf = (child & KILN_BVH_LEAF) != 0;
      const Box& box = leaf ? leaf_boxes[child & ~KILN_BVH_LEAF] : node_boxes[child];
      node_boxes[i].include(box);
      for (int axis = 0; axis < 3; ++axis) {
        node.planes[axis][0][c] = box.lo[axis] - KILN_BVH_EPSILON;
        node.planes[axis][1][c] = box.hi[axis] + KILN_BVH_EPSILON;
      }
    }
  }
}

}  // namespace kiln
