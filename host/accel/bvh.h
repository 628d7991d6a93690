// Bounding volume hierarchy over triangles, built on the host.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "kiln/types.h"
#include "shared/bvh.h"

namespace kiln {

/// A tree of 8-wide nodes over leaves of up to 4 triangles, in the layout that kernels read. Node 0
/// is the root. A child's index is larger than its parent's.
///
/// Memory: about 256 B a node and 160 B a leaf; 70 to 90 B a triangle on scanned meshes.
struct Bvh {
  std::unique_ptr<kiln_bvh_node[]> node_data;
  std::unique_ptr<kiln_bvh_block[]> block_data;
  std::size_t node_count = 0;
  std::size_t block_count = 0;
  std::uint64_t triangles = 0;   ///< In the tree
  std::uint64_t skipped = 0;     ///< With a non-finite corner, or without area: in no leaf
  std::uint64_t duplicates = 0;  ///< With all corners of one of a lower index: in no leaf
  std::uint32_t depth = 0;       ///< Levels of nodes, at most KILN_BVH_MAX_DEPTH
  /// Leaves whose boxes a straight line through the root's box meets on average (MacDonald, Booth 1990,
  /// "Heuristics for ray tracing using space subdivision", section 2): few for scans, a share of all for a fan of
  /// needles. Of the tree as it was built.
  double leaves_a_line = 0;
  std::uint64_t prisms = 0;  ///< Among the nodes: see kiln_bvh_prism

  std::span<const kiln_bvh_node> nodes() const { return {node_data.get(), node_count}; }
  std::span<const kiln_bvh_block> blocks() const { return {block_data.get(), block_count}; }
};

/// Builds top down by the surface area heuristic over binned centroids (Wald 2007, "On fast
/// construction of SAH-based bounding volume hierarchies"). It opens the child with the largest
/// surface until a node has 8 children (Wald, Benthin, Boulos 2008, section 3).
///
/// The tree is the same for any number of threads. Its depth is bounded for any input: from a fixed
/// level on ranges are halved at the median of the widest axis. Triangles whose boxes have one centre are
/// halved by the size of their boxes; equal ones are merged first, since no query can tell
/// them apart: ties go to the lowest index.
///
/// \param positions  in the working frame: about unit size
/// \param triangles  any number, none included, below 2^31
/// Nodes get bounding prisms if their boxes overlap much (large triangles over each other, fans).
///
/// \param merge  false: keep triangles that are the same now, and no bounding prisms, for positions that will move
/// \throws Error(input) where an index lies beyond the positions
/// Cost: O(n log n); about 1.5 million triangles a second and thread.
Bvh build_bvh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
              bool merge = true);

/// Fits a tree's leaves and boxes to moved positions of the same triangles, bottom up; which child holds
/// what stays as it is. Boxes are as tight as a fresh tree's would be.
/// Cost: O(n), leaves in parallel.
void refit_bvh(Bvh& bvh, std::span<const Vec3> positions, std::span<const Triangle> triangles);

/// The node of a child that is no leaf.
inline std::uint32_t node_of_child(std::uint32_t child) {
  return (child & KILN_BVH_PRISM) != 0 ? (child & ~KILN_BVH_PRISM) + 1 : child;
}

}  // namespace kiln
