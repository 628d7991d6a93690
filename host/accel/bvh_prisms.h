// Adds bounding prisms to nodes whose children's boxes overlap much.
#pragma once

#include "accel/bvh.h"

namespace kiln::bvh {

/// Minimum average number of leaves that a line through a node's box crosses for bounding prisms to be
/// worthwhile. Scans, grids and parts have 3 to 20.
inline constexpr double kMinCrowdedLeaves = 64;

/// Inserts bounding prisms before nodes of crowded parts of a tree, if a prism is much smaller than the box. Results
/// of searches do not change. Cost: O(n log n) of the crowded part, in parallel.
void add_prisms(Bvh& bvh);

}  // namespace kiln::bvh
