// The low poly's normal map, splatted from the fine vertices.
#pragma once

#include "cl/context.h"
#include "kiln/contour.h"
#include "volume/atlas.h"
#include "volume/fine_surface.h"
#include "volume/simplified_isosurface.h"

namespace kiln {

/// \param texels_per_cell  texels per cell of the volume. This is also the width of the band along
///   seams in which charts are changed so that they agree at the seam.
/// \param splatted  [out] number of texels that contain fine vertices
Image splat_normals(cl::Context& context, const FineSurface& surface,
                    const SimplifiedIsosurface& low_poly, const Atlas& atlas,
                    double texels_per_cell, const ExtractOptions& options, std::uint64_t& splatted);

}  // namespace kiln
