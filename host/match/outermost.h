// Rays that match the outermost face within reach that the low poly does not hide.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// A matcher that selects, among the high poly's faces that face the sample within the distance, the outermost one
/// along its direction: the one that a viewer there sees. The low poly bounds it in two ways:
/// - The ray ends where it enters the low poly again: faces beyond belong to another part or fold.
/// - If the ray first leaves the low poly, the sample lies inside of another part and is invisible: the nearest face
///   counts, as by RayRule::nearest.
/// If at most one face lies outward, the result equals RayRule::nearest to the bit.
std::unique_ptr<Matcher> outermost_matcher(const MatchRequest& request);

}  // namespace kiln
