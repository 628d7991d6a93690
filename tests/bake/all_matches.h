// Bakes by every match.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/bake.h"

namespace kiln::test {

/// A bake by each match that there is, and one by several.
inline std::vector<BakeOptions> bakes_by_all_matches(std::uint32_t size,
                                                     const std::vector<MapKind>& maps) {
  std::vector<BakeOptions> all;
  for (const MatchInfo& match : matches()) {
    BakeOptions options;
    options.width = options.height = size;
    options.match.method = match.method;
    options.maps = maps;
    options.occlusion.rays = 16;
    options.match.views.count = 8;
    if (match.method == MatchMethod::axis) options.match.views.directions = {{0, 0, 1}};
    options.match.visibility.directions = 24;
    options.report.keep_match = true;
    all.push_back(options);
  }
  all.push_back(all.front());
  all.back().match.fallback = {MatchMethod::views, MatchMethod::closest};
  return all;
}

}  // namespace kiln::test
