// --max-error normal=1.5,ao=2/255: what single maps are to reach.
#pragma once

#include <string>
#include <vector>

#include "arguments/bake_job.h"
#include "kiln/map.h"
#include "report/json.h"

namespace kiln::cli {

/// The bounds of all maps but the normal map. Names stay as long as the arguments do.
/// \throws Error(usage) for what is no list of them, or bounds a map that is not baked
std::vector<MapBound> map_bounds(const BakeJob& arguments);

/// The text after "normal="; empty where there is no such item.
/// \throws Error(usage) where nothing stands after it
std::string normal_bound(const std::string& max_error);

/// "ao reached 0.0052 of 0.00784 wanted (root mean square at 2,003 points)".
std::string describe(const MapReached& map);
Json bounds_json(const std::vector<MapReached>& bounds);

}  // namespace kiln::cli
