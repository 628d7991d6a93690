// Matches for what another leaves undecided.
#pragma once

#include <memory>
#include <vector>

#include "match/matcher.h"

namespace kiln {

/// One match, then others in turn, at least one, for the samples that are still undecided.
std::unique_ptr<Matcher> with_fallbacks(cl::Context& context, std::unique_ptr<Matcher> first,
                                        std::vector<std::unique_ptr<Matcher>> rest);

}  // namespace kiln
