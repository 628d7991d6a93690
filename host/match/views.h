// Matching by depth views, for the match and for sessions that add views one by one.
#pragma once

#include "match/registry.h"
#include "match/view_plan.h"

namespace kiln {

/// Pixels a side of a view, at most.
inline constexpr std::uint32_t kLargestView = 8192;

/// A view's direction with length 1. \throws Error(usage) where it has none
Vec3d unit_direction(const Vec3& toward);

ViewQuery view_query(const MatchRequest& request);

}  // namespace kiln
