// Rays that take the outermost face within their reach that the light mesh does not hide.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// Of the faces of the dense mesh within the distance that face the sample, the one farthest out along its
/// direction: what a viewer there sees. Two bounds, both by the light mesh:
/// - The ray ends where it enters the light mesh again: what lies beyond is another part's, or a fold's.
/// - Where it leaves the light mesh instead, the sample lies inside of another part, and nobody sees it:
///   the nearest face counts, as by RayRule::nearest.
/// Where at most one face lies outward, the answer is that of RayRule::nearest to the bit.
std::unique_ptr<Matcher> outermost_matcher(const MatchRequest& request);

}  // namespace kiln
