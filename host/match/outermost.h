// Rays that match the outermost face within the search distance that the low poly does not hide.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// A matcher that selects the outermost of the high poly's faces along the sample's direction, among the front
/// faces within the search distance: the one that a viewer in that direction sees. The low poly limits the search
/// by two rules:
/// - The ray ends where it enters the low poly again: faces beyond that point belong to another part or fold.
/// - If the ray first leaves the low poly, the sample lies inside of another part and is invisible: the nearest face
///   is selected, as by RayRule::nearest. If at most one face lies outward, the result equals RayRule::nearest to
///   the bit.
std::unique_ptr<Matcher> outermost_matcher(const MatchRequest& request);

}  // namespace kiln
