// Widths of the high poly's bevels along the low poly's hard edges.
#pragma once

#include <vector>

#include "kiln/match.h"
#include "mesh/hard_edges.h"
#include "source/high_poly.h"

namespace kiln {

/// Widths found along hard edges. Lengths in frame units.
struct Bevels {
  std::vector<float> widths;  ///< Per edge: over what rays turn there, above 0
  std::size_t found = 0;      ///< Edges whose own bevel was found; the others take the median
  float median = 0;           ///< Median of those found; 0 where none was
};

/// Looks at the high poly along the normals of the low poly's faces. It does so at several places along each hard
/// edge and several distances from it. A bevel ends where the high poly is parallel to the face; rays turn over two
/// fifths of its width. Or, where that is more, over twice how much farther out the high poly lies on both sides.
/// \param reach  how far to look each way
/// \param parts  places find their own part alone; may be null
Bevels find_bevels(const Source::Impl& high, const LowSurface& surface, const HardEdges& hard,
                   double reach, const Parts* parts);

}  // namespace kiln
