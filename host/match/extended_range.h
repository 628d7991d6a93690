// A second search with a larger distance for samples on open sheets without a match.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// Casts rays; samples that miss are cast again both ways, up to the sheet's own size (TexelBand::points,
/// the last plane: see SheetReach), for the nearest face outward, else the nearest inward. A leaf may bend
/// farther off its card than kSearchDistance.
std::unique_ptr<Matcher> extended_range(std::unique_ptr<Matcher> near, const MatchRequest& request);

}  // namespace kiln
