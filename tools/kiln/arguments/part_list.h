// Which parts belong together: --match-by and its list.
#pragma once

#include <string>
#include <vector>

#include "kiln/match.h"

namespace kiln::cli {

/// Lines LOW = HIGH, HIGH; empty ones and those after # say nothing.
/// \param what  begins the message, such as "--match-list 'pairs.txt'"
/// \throws Error(input) for a line that is none, and where there is no pair
std::vector<PartPair> parse_part_list(const std::string& list, const std::string& what);

}  // namespace kiln::cli
