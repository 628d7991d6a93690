// Selects the warnings to print: those that are not caused by another one.
#pragma once

#include <cstddef>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// The warnings that are not caused by another one, in their order. Reports contain all warnings.
/// \param of_high  number of leading warnings about the high poly's file; the others are about the low poly, or the
///                 bake
std::vector<Warning> root_causes(const std::vector<Warning>& warnings, std::size_t of_high);

}  // namespace kiln
