// Faces that a cage must take in, and others that it must stay clear of.
#pragma once

#include <cstdint>
#include <vector>

#include "kiln/match.h"
#include "match/registry.h"
#include "match/surface_places.h"
#include "texel/edge_turn.h"

namespace kiln {

/// Needs of places all over the low poly, along the directions of the bake. Frame units.
struct CageNeeds {
  SurfacePlaces places;
  std::vector<std::uint8_t> counts;  ///< 0: another part of the low poly covers it
  std::vector<std::uint8_t> found;   ///< It has a face
  /// Start of rays above the place: from `outward` on they meet its face first, from `outward_most` on another one.
  std::vector<float> outward, outward_most;
  std::vector<float> inward,
      inward_most;              ///< Depth of the face below the place, and of the next one below it
  std::vector<Vec3> direction;  ///< Directions of the places' rays, unit
};

/// A place's face is the first of these that there is: the one where its ray leaves a solid beyond the request's
/// distance that it entered within it; the outermost within the distance; the nearest inward.
/// \param request  without a cage
/// \param turn     as directions turn in the bake
/// \param parts    places find their own part alone, and only that bounds them; may be null
CageNeeds find_cage_needs(const MatchRequest& request, const EdgeTurn& turn, const Parts* parts);

}  // namespace kiln
