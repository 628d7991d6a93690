// Second search for samples that miss along blended directions at hard edges.
#pragma once

#include <memory>

#include "match/matcher.h"
#include "match/registry.h"

namespace kiln {

/// A matcher that casts the rays of missed samples again, along averaged directions: where a corner of
/// the low poly overhangs a rounded edge of the high poly, rays along the face's normal may hit
/// nothing.
std::unique_ptr<Matcher> smooth_normal_retry(std::unique_ptr<Matcher> first,
                                             const MatchRequest& request);

}  // namespace kiln
