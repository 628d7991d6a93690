// What a plan of a low poly takes.
#pragma once

#include "kiln/light_plan.h"

namespace kiln {

/// \throws Error(usage) for options out of range, or that belong to a given low poly
void check_light_plan(const LightPlanOptions& options);

}  // namespace kiln
