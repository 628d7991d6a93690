// Plans of low polys that share what they simplify.
#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include "kiln/light_plan.h"
#include "lowpoly/simplify_levels.h"

namespace kiln {

/// Low polys of one high poly, by the faces of the finest.
using LevelCache = std::map<std::uint32_t, std::shared_ptr<const SimplifyLevels>>;

/// bake_light(), its options checked.
LightBake plan_light(const Source& source, const Mesh& high, const LightPlanOptions& options,
                     LevelCache& cache);

}  // namespace kiln
