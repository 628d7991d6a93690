// A match for what another leaves undecided.
#pragma once

#include "match/matcher.h"

namespace kiln {

/// One match, then another for the samples that it leaves undecided.
std::unique_ptr<Matcher> with_fallback(cl::Context& context, std::unique_ptr<Matcher> first,
                                       std::unique_ptr<Matcher> second);

}  // namespace kiln
