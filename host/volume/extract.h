// A low poly with its map from a contour that is there.
#pragma once

#include "cl/context.h"
#include "kiln/contour.h"
#include "volume/fine_surface.h"
#include "volume/vertex_tree.h"

namespace kiln {

/// \throws Error(usage) for an option out of range
void check_extract_options(const ExtractOptions& options);

/// \param contour  of the surface
/// \param seconds_tree  that the tree took; counted to seconds_simplify and seconds_total
ExtractResult extract_from(cl::Context& context, const Volume& volume, const FineSurface& surface,
                           const VertexTree& tree, const ExtractOptions& options,
                           const ContourReport& contour, double seconds_tree);

}  // namespace kiln
