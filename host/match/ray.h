// Ray queries for matches that cast rays.
#pragma once

#include "accel/ray.h"
#include "match/registry.h"

namespace kiln {

/// Makes the query: from the cage inward, if there is a cage and `with_cage` is set; else outward first, then
/// inward.
RayQuery ray_query(const MatchRequest& request, bool with_cage);

}  // namespace kiln
