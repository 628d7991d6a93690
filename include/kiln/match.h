#pragma once

#include <span>
#include <string_view>

#include "kiln/bake.h"

namespace kiln {

/// A way to match that bake() knows.
struct MatchInfo {
  MatchMethod method;         ///< Its name, for BakeOptions::method
  std::string_view searches;  ///< What it searches, in words
  bool needs_uvs = false;     ///< Of the high poly
  /// It needs exactly one of BakeOptions::views.directions, so it cannot be tried without being told more.
  bool needs_direction = false;
  bool looks_far = true;          ///< It obeys BakeOptions::max_distance
  bool takes_cage = false;        ///< It obeys BakeOptions::cage and cage_mesh
  bool takes_directions = false;  ///< It obeys BakeOptions::views.directions
  bool takes_visibility = false;  ///< It obeys BakeOptions::visibility
};

/// All of them, in the order that they are listed to people.
std::span<const MatchInfo> matches();

/// \throws Error(usage) for a name that no match has; the message lists those there are
const MatchInfo& find_match(std::string_view name);

}  // namespace kiln
