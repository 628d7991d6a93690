// A second search, with a larger distance, for samples on open sheets that found no match.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// Makes a matcher that casts rays, and then casts the rays of samples that miss again, outward and inward, up to the
/// size of the sample's open sheet (TexelBand::points, the last plane; see SheetReach). These match the nearest face
/// outward, else the nearest one inward. For instance, a leaf may bend farther from its card than kSearchDistance.
std::unique_ptr<Matcher> extended_range(std::unique_ptr<Matcher> near_matcher,
                                        const MatchRequest& request);

}  // namespace kiln
