// Fallback matches for undecided samples.
#pragma once

#include <memory>
#include <vector>

#include "match/matcher.h"

namespace kiln {

/// Runs one match, then the fallbacks in turn for the samples that are still undecided.
std::unique_ptr<Matcher> with_fallbacks(cl::Context& context, std::unique_ptr<Matcher> first,
                                        std::vector<std::unique_ptr<Matcher>> fallbacks);

}  // namespace kiln
