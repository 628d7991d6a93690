// Estimates the widths of the high poly's bevels along the low poly's hard edges.
#pragma once

#include <vector>

#include "kiln/match.h"
#include "mesh/hard_edges.h"
#include "source/high_poly.h"

namespace kiln {

/// Blend widths along hard edges. Lengths in frame units.
struct Bevels {
  std::vector<float> widths;  ///< Blend width per edge, above 0
  /// Number of edges whose blend width is estimated from their own rays; the others get the median
  std::size_t found = 0;
  float median = 0;  ///< Median of the estimates; 0 without estimates
};

/// Measures the high poly along the normals of the low poly's faces, at several places along each hard edge and
/// several distances from it. A bevel ends where the high poly is parallel to the face. The blend width is 2/5 of
/// the bevel's width, or twice the height of the high poly above the low poly on both sides, whichever is larger.
/// \param reach search distance, outward and inward
/// \param parts points match only their own part; may be null
Bevels find_bevels(const Source::Impl& high, const LowSurface& surface, const HardEdges& hard,
                   double reach, const Parts* parts);

}  // namespace kiln
