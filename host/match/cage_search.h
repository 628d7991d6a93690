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
  std::vector<float> outward,
      outward_most;                        ///< From where rays meet the face first: at least, below
  std::vector<float> inward, inward_most;  ///< How deep the face lies, and what lies below it
  std::vector<Vec3> direction;             ///< Of the places' rays, unit
};

/// A place's face is the outermost within the request's distance; where its ray enters a solid within the
/// distance, and leaves it beyond, the face where it leaves it; where there is neither, the nearest inward.
/// \param request  without a cage
/// \param turn     as directions turn in the bake
/// \param parts    places find their own part alone, and only that bounds them; may be null
CageNeeds find_cage_needs(const MatchRequest& request, const EdgeTurn& turn, const Parts* parts);

}  // namespace kiln
