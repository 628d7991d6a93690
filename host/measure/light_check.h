// What a plan of a low poly takes.
#pragma once

#include <cstdint>

#include "kiln/light_plan.h"

namespace kiln {

/// Texels a side.
inline constexpr std::uint32_t kSmallestMap = 16;

/// \throws Error(usage) for options out of range, or that belong to a given low poly
void check_light_plan(const LightPlanOptions& options);

}  // namespace kiln
