// Which warnings of a run are told: those that follow from no other one.
#pragma once

#include <cstddef>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// The warnings that follow from no other one of them, in their order. Reports keep all of them.
/// \param of_high  how many at the front came from reading the high poly; the others are about the low
///                 poly, or the bake
std::vector<Warning> root_causes(const std::vector<Warning>& warnings, std::size_t of_high);

}  // namespace kiln
