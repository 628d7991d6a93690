// Selects the warnings to print: those that no other warning causes.
#pragma once

#include <cstddef>
#include <vector>

#include "kiln/error.h"

namespace kiln {

/// Returns the warnings that no other warning causes, in their order. Reports contain all warnings.
/// \param of_high number of warnings about the high poly's file, which come first; the others are about the low poly or
/// the bake
std::vector<Warning> root_causes(const std::vector<Warning>& warnings, std::size_t of_high);

}  // namespace kiln
