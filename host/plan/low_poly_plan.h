// Plans one of several low polys that share their simplified meshes.
#pragma once

#include <cstdint>

#include "kiln/plan.h"
#include "plan/level_evaluator.h"

namespace kiln {

/// Checks the options of a plan. \throws Error(usage) for options out of range, and for options that require a given
/// low poly
void check_plan(const LowPolyPlanOptions& options);

/// Does the work of plan_low_poly(), for options that were checked. \param max_faces maximum face
/// count of the low poly; 0: unlimited
LowPolyPlan plan_levels(const Source& source, const Mesh& high, const LowPolyPlanOptions& options,
                        LevelCache& cache, std::uint64_t max_faces = 0);

}  // namespace kiln
