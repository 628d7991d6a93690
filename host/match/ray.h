// Rays, for the matches that cast them.
#pragma once

#include "accel/ray.h"
#include "match/registry.h"

namespace kiln {

/// From the cage inward, where there is one and it counts; else both ways, outward first.
RayQuery ray_query(const MatchRequest& request, bool with_cage);

}  // namespace kiln
