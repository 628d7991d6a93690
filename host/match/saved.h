// A saved correspondence, used instead of a match.
#pragma once

#include "match/matcher.h"

namespace kiln {

/// \param saved must outlive the matcher, and have passed check_match() (match_array.h)
/// \param unit   world length of a frame unit
std::unique_ptr<Matcher> saved_matcher(cl::Context& context, const Match& saved, double unit);

}  // namespace kiln
