// A second search, with a larger distance, for samples on open sheets that found no match.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// Casts rays; samples that miss are cast again outward and inward, up to the sheet's own size
/// (TexelBand::points, the last plane; see SheetReach). They match the nearest face outward, else the
/// nearest one inward. A leaf may bend farther from its card than kSearchDistance.
std::unique_ptr<Matcher> extended_range(std::unique_ptr<Matcher> near_matcher,
                                        const MatchRequest& request);

}  // namespace kiln
