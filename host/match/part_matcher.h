// Matching part by part: samples find points of their own part alone.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// One matcher of a row for each part that both meshes have, told of nothing but the part: its triangles of
/// the high poly, and its own triangles of the low poly for what they hide from themselves. So it cannot find a
/// point of another part, however the parts lie. Samples on a part without dense triangles are missed.
/// \param parts  outlives the matcher
/// \throws Error(usage) for lists of other lengths, and for a match that does not obey MatchOptions::parts
std::unique_ptr<Matcher> part_matcher(const MatchRow& row, const MatchRequest& request,
                                      const Parts& parts, MatchNotes& notes);

}  // namespace kiln
