// Finds the faces that a cage must enclose, and the faces that must stay outside of it.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/match.h"
#include "match/registry.h"
#include "match/surface_places.h"
#include "texel/sample_directions.h"

namespace kiln {

/// Bounds on a cage at points all over the low poly, along the directions of the bake. Frame units.
struct CageNeeds {
  SampledPoints points;
  /// 0 if another part of the low poly covers the point, which is then ignored
  std::vector<std::uint8_t> counts;
  std::vector<std::uint8_t> found;  ///< 1 if the point has a face of the high poly
  /// Heights at which a ray may start: between `outward` and `outward_most` it hits the point's face first;
  /// above `outward_most` it hits another face first.
  std::vector<float> outward, outward_most;
  std::vector<float> inward,
      inward_most;              ///< Depths of the first and of the second face below the point
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
