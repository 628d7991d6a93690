// Prisms around nodes whose boxes overlap much.
#pragma once

#include "accel/bvh.h"

namespace kiln::bvh {

/// Number of leaves that a line through a node's box meets on average, above which bounding prisms may pay. Scans,
/// grids and parts have 3 to 20.
inline constexpr double kCrowded = 64;

/// Puts bounding prisms before nodes of crowded parts of a tree, where a prism is much smaller than the box. No search
/// finds anything else than without.
/// Cost: O(n log n) of the crowded part, in parallel.
void add_prisms(Bvh& bvh);

}  // namespace kiln::bvh
