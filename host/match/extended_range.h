// A second search with a larger distance, for samples that lie on open sheets and have no point
// yet.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// Makes a matcher that casts rays, and casts those of samples that miss a second time, outward and
/// inward, up to the size of the sample's open sheet (TexelBand::points, the last plane; see
/// SheetDistances). The second search takes the nearest face outward, else the nearest one inward.
/// This finds, for instance, leaves that bend farther away from their card than kSearchDistance.
std::unique_ptr<Matcher> make_extended_range_matcher(std::unique_ptr<Matcher> near_matcher,
                                                     const MatchRequest& request);

}  // namespace kiln
