// Samples that miss along directions that turned at hard edges.
#pragma once

#include <memory>

#include "match/matcher.h"
#include "match/registry.h"

namespace kiln {

/// A matcher whose misses look once more, along averaged directions: a corner of the low poly may stand over
/// the high poly's rounding, with nothing under it.
std::unique_ptr<Matcher> smooth_normal_retry(std::unique_ptr<Matcher> first,
                                             const MatchRequest& request);

}  // namespace kiln
