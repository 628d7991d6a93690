// Extracts a low poly and its map from an existing contour.
#pragma once

#include "cl/context.h"
#include "kiln/contour.h"
#include "volume/fine_surface.h"
#include "volume/vertex_tree.h"

namespace kiln {

/// \throws Error(usage) for an option out of its range
void check_extract_options(const ExtractOptions& options);

/// \param contour  report about the making of `surface`
/// \param seconds_tree  time for building the tree, which is added to seconds_simplify and
///   seconds_total
ExtractResult extract_from(cl::Context& context, const Volume& volume, const FineSurface& surface,
                           const VertexTree& tree, const ExtractOptions& options,
                           const ContourReport& contour, double seconds_tree);

}  // namespace kiln
