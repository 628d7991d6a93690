// A second, longer look for samples on open sheets that found nothing near.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// Rays, then rays both ways up to the sheet's own size (TexelBand::points, the last plane: see SheetReach)
/// for what they missed: the nearest outward, else the nearest inward. A leaf bends farther off its card
/// than kSearchDistance.
std::unique_ptr<Matcher> extended_range(std::unique_ptr<Matcher> near, const MatchRequest& request);

}  // namespace kiln
