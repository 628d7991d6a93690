// Faces that a cage must enclose, and faces that it must stay clear of.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/match.h"
#include "match/registry.h"
#include "match/surface_places.h"
#include "texel/edge_turn.h"

namespace kiln {

/// Requirements of places all over the low poly, along the directions of the bake. Frame units.
struct CageNeeds {
  SurfacePlaces places;
  std::vector<std::uint8_t> counts;  ///< 0: covered by another part of the low poly, and ignored
  std::vector<std::uint8_t> found;   ///< 1: the place has a face
  /// Heights at which a ray may start: at `outward` and above it hits the place's face first, above `outward_most`
  /// another one.
  std::vector<float> outward, outward_most;
  std::vector<float> inward,
      inward_most;              ///< Depth of the face below the place, and of the next one below
                                ///< that
  std::vector<Vec3> direction;  ///< Unit directions of the places' rays
};

/// Determines the face of each place, by the first rule that applies: the top of a solid that begins within the
/// search distance and ends beyond it; the outermost face within the distance; the nearest face inward.
/// \param request  without a cage
/// \param turn     direction blending of the bake
/// \param parts    places match, and are bounded by, only their own part; may be null
CageNeeds find_cage_needs(const MatchRequest& request, const EdgeTurn& turn, const Parts* parts);

}  // namespace kiln
