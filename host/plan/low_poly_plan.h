// Plans of low polys that share their simplified meshes.
#pragma once

#include <cstdint>

#include "kiln/plan.h"
#include "plan/level_evaluator.h"

namespace kiln {

/// \throws Error(usage) for options out of range, and for options that only a given low poly can have
void check_plan(const LowPolyPlanOptions& options);

/// plan_low_poly() with checked options.
/// \param most_faces  maximum faces of the low poly; 0: unlimited
LowPolyPlan plan_levels(const Source& source, const Mesh& high, const LowPolyPlanOptions& options,
                        LevelCache& cache, std::uint64_t most_faces = 0);

}  // namespace kiln
