// Matching by depth views, for the match and for sessions that add views one by one.
#pragma once

#include "match/registry.h"
#include "match/view_plan.h"

namespace kiln {

/// Largest side of a view, pixels.
inline constexpr std::uint32_t kMaxViewSide = 8192;

/// The normalised direction of a view. \throws Error(usage) for a zero vector
Vec3d unit_direction(const Vec3& toward);

ViewQuery view_query(const MatchRequest& request);

}  // namespace kiln
