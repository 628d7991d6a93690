// Matching part by part: samples match only their own part.
#pragma once

#include <memory>

#include "match/registry.h"

namespace kiln {

/// Creates one matcher for each part that both meshes have, from the part's triangles alone. Such a matcher
/// cannot find a point of another part, and only the part's own low poly occludes. Samples on a part without
/// triangles of the high poly are misses.
/// \param parts must outlive the matcher
/// \throws Error(usage) for lists of wrong lengths, and for a match that does not support MatchOptions::parts
std::unique_ptr<Matcher> part_matcher(const MatchRow& row, const MatchRequest& request,
                                      const Parts& parts, MatchNotes& notes);

}  // namespace kiln
