// Prisms around nodes whose boxes overlap much.
#pragma once

#include "accel/bvh.h"

namespace kiln::bvh {

/// Where a straight line through a node's box meets more leaves than this on average, guards may pay. Scans,
/// grids and parts have 3 to 20.
inline constexpr double kCrowded = 64;

/// Puts guards before nodes of crowded parts of a tree, where a prism is much smaller than the box. No search
/// finds anything else than without.
/// Cost: O(n log n) of the crowded part, in parallel.
void add_prisms(Bvh& bvh);

}  // namespace kiln::bvh
