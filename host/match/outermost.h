// Rays that take the outermost face within their reach that the low poly does not hide.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// A matcher that takes, of the high poly's faces that face the sample within the distance, the one farthest out along
/// its direction: what a viewer there sees. Two bounds, both by the low poly:
/// - The ray ends where it enters the low poly again: what lies beyond is another part's, or a fold's.
/// - Where it leaves the low poly instead, the sample lies inside of another part, and nobody sees it:
///   the nearest face counts, as by RayRule::nearest.
/// If at most one face lies outward, the answer is that of RayRule::nearest to the bit.
std::unique_ptr<Matcher> outermost_matcher(const MatchRequest& request);

}  // namespace kiln
