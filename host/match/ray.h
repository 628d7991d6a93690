// Ray queries for matches that cast rays.
#pragma once

#include "accel/ray.h"
#include "match/registry.h"

namespace kiln {

/// From the cage inward, if there is one and `with_cage` is set; else both ways, outward first.
RayQuery ray_query(const MatchRequest& request, bool with_cage);

}  // namespace kiln
