// Finds the faces that a cage must enclose, and the faces that must stay outside of it.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/match.h"
#include "match/registry.h"
#include "match/surface_places.h"
#include "texel/sample_directions.h"

namespace kiln {

/// Bounds on the heights of a cage's shells over points all over the low poly, along the bake's ray
/// directions. Frame units.
struct CageNeeds {
  SampledPoints points;
  /// 0 if another part of the low poly covers the point, so that the point is ignored
  std::vector<std::uint8_t> counts;
  std::vector<std::uint8_t> found;  ///< 1 if the point has a face of the high poly
  /// Heights at which a ray may start: between `min_outward_height` and `max_outward_height` it hits the
  /// point's face first; above `max_outward_height` it hits another face first.
  std::vector<float> min_outward_height, max_outward_height;
  /// Depths of the first and of the second face of the high poly below the point
  std::vector<float> min_inward_depth, max_inward_depth;
  std::vector<Vec3> direction;  ///< Unit directions of the points' rays
};

/// Finds the high poly's face of each point by the first rule that applies: the top of a solid that begins
/// within the search distance and ends beyond it; the outermost face within the distance; the nearest face
/// inward.
/// \param request  without a cage
/// \param directions  directions of the bake
/// \param parts points match only their own part, and only its faces bound them; may be null
CageNeeds find_cage_needs(const MatchRequest& request, const SampleDirections& directions,
                          const Parts* parts);

}  // namespace kiln
