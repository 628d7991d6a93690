// From what a cage must take in to how far its shells lie off each vertex.
#pragma once

#include <cstdint>
#include <vector>

#include "match/cage_search.h"

namespace kiln {

/// Along the vertices' directions, equal for vertices in the same place. Frame units.
struct CageShells {
  std::vector<float> outward, inward;
  std::uint64_t conflicts = 0;  ///< Places with another face within the outer shell
};

/// Each vertex takes the most that places on the faces around it need, and a quarter more. Steps to
/// neighbours are smoothed, upward. Then places in their order move the corners of their triangles,
/// round by round. The least move counts that puts a place between its need and its bound. Needs have
/// the last word: a lost part is seen, and where bounds are broken other parts mostly hide the place.
/// \param surface    whose vertices move along their directions
/// \param vertex_of  three a triangle: vertices, equal in the same place
/// \param margin     at least so much more, where there is room
CageShells fit_shells(const CageNeeds& needs, const LowSurface& surface,
                      const std::vector<std::uint32_t>& vertex_of, std::size_t vertices,
                      double margin);

}  // namespace kiln
