// Bounding volume hierarchy over triangles, built on the host.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "kiln/types.h"
#include "shared/bvh.h"

namespace kiln {

/// A tree of 8-wide nodes over leaves of up to 4 triangles, in the layout of the kernels. Node 0 is
/// the root. A child's index is larger than its parent's.
///
/// Memory: about 256 B per node and 160 B per leaf; 70 to 90 B per triangle on scanned meshes.
struct Bvh {
  std::unique_ptr<kiln_bvh_node[]> node_data;
  std::unique_ptr<kiln_bvh_block[]> block_data;
  std::size_t node_count = 0;
  std::size_t block_count = 0;
  std::uint64_t triangles = 0;  ///< Triangles in the tree
  /// Triangles with a non-finite corner or without area; they are in no leaf
  std::uint64_t skipped = 0;
  std::uint64_t duplicates = 0;  ///< Triangles equal to one of a lower index; they are in no leaf
  std::uint32_t depth = 0;       ///< Levels of nodes, at most KILN_BVH_MAX_DEPTH
  /// Average number of leaves whose boxes a random line through the root's box crosses (MacDonald, Booth 1990,
  /// "Heuristics for ray tracing using space subdivision", section 2): few for scans, a constant share of all
  /// leaves for a fan of needles. Refits do not update it.
  double leaves_per_line = 0;
  std::uint64_t prisms = 0;  ///< Prisms among the nodes: see kiln_bvh_prism

  std::span<const kiln_bvh_node> nodes() const { return {node_data.get(), node_count}; }
  std::span<const kiln_bvh_block> blocks() const { return {block_data.get(), block_count}; }
};

/// Builds top down by the surface area heuristic over binned centroids (Wald 2007, "On fast construction of
/// SAH-based bounding volume hierarchies"). It splits the child with the largest surface until a node has 8
/// children (Wald, Benthin, Boulos 2008, section 3).
///
/// The tree is the same for any number of threads. Its depth is bounded for any input: from a fixed level on
/// ranges are halved at the median of the widest axis. Triangles whose boxes share a centre are halved by the size
/// of their boxes; duplicates are merged first, since queries return the lowest index anyway.
///
/// \param positions  in the working frame: about unit size
/// \param triangles any number below 2^31; may be empty. Nodes get bounding prisms if their
/// boxes overlap much (stacked large triangles, fans).
///
/// \param merge  false: keep duplicates and make no bounding prisms, for positions that will move
/// \throws Error(input) if an index lies beyond the positions
/// Cost: O(n log n); about 1.5 million triangles a second and thread.
Bvh build_bvh(std::span<const Vec3> positions, std::span<const Triangle> triangles,
              bool merge = true);

/// Refits a tree's leaves and boxes to moved positions of the same triangles, bottom up; the topology is
/// kept. Boxes are as tight as in a new tree. Cost: O(n), leaves in parallel.
void refit_bvh(Bvh& bvh, std::span<const Vec3> positions, std::span<const Triangle> triangles);

/// The node of a child that is not a leaf.
inline std::uint32_t node_of_child(std::uint32_t child) {
  return (child & KILN_BVH_PRISM) != 0 ? (child & ~KILN_BVH_PRISM) + 1 : child;
}

}  // namespace kiln
