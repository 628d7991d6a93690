// Fallback matches for samples without a point.
#pragma once

#include <memory>
#include <vector>

#include "match/matcher.h"

namespace kiln {

/// Makes a matcher that runs one match, and then one fallback after another for the samples that
/// still have no point.
std::unique_ptr<Matcher> with_fallbacks(cl::Context& context, std::unique_ptr<Matcher> first,
                                        std::vector<std::unique_ptr<Matcher>> fallbacks);

}  // namespace kiln
