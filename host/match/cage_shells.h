// Fits the shells of a cage, as offsets of vertices, to the requirements of CageNeeds.
#pragma once

#include <cstdint>
#include <vector>

#include "match/cage_search.h"

namespace kiln {

/// Offsets along the vertices' directions, equal for vertices at the same position. Frame units.
struct CageShells {
  std::vector<float> outward, inward;
  /// Number of points whose ray crosses another face within the outer shell
  std::uint64_t conflicts = 0;
};

/// Each vertex starts with the largest offset that points on the adjacent faces need, plus 25%. Steps
/// to neighbours are smoothed upward. Then, in passes over the points in their order, the corners of
/// each point's triangle are moved by the smallest change that brings the shell between the point's
/// needed height and its bound. Needed heights take precedence over bounds: a missing part is
/// visible, while points with violated bounds are mostly hidden.
/// \param surface    vertices move along its directions
/// \param vertex_of  three vertex indices per triangle, equal at the same position
/// \param margin minimum extra height, if the clearance allows it
CageShells fit_shells(const CageNeeds& needs, const LowSurface& surface,
                      const std::vector<std::uint32_t>& vertex_of, std::size_t vertices,
                      double margin);

}  // namespace kiln
