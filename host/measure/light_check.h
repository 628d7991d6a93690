// What a plan of a light mesh takes.
#pragma once

#include <cstdint>

#include "kiln/light_plan.h"

namespace kiln {

/// Texels a side.
inline constexpr std::uint32_t kSmallestMap = 16;

/// \throws Error(usage) for options out of range, or that belong to a given light mesh
void check_light_plan(const LightPlanOptions& options);

}  // namespace kiln
