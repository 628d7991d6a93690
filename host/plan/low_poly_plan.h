// Plans of low polys that share what they simplify.
#pragma once

#include <cstdint>

#include "kiln/plan.h"
#include "plan/level_evaluator.h"

namespace kiln {

/// \throws Error(usage) for options out of range, or that belong to a given low poly
void check_plan(const LowPolyPlanOptions& options);

/// plan_low_poly(), its options checked.
/// \param most_faces  of the low poly; 0: any
LowPolyPlan plan_levels(const Source& source, const Mesh& high, const LowPolyPlanOptions& options,
                        LevelCache& cache, std::uint64_t most_faces = 0);

}  // namespace kiln
