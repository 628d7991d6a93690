// The light mesh's normal map, from the fine vertices.
#pragma once

#include "cl/context.h"
#include "kiln/contour.h"
#include "volume/atlas.h"
#include "volume/fine_surface.h"
#include "volume/light_surface.h"

namespace kiln {

/// \param splatted  [out] texels that fine vertices fell into
Image splat_normals(cl::Context& context, const FineSurface& surface, const LightSurface& light,
                    const Atlas& atlas, const ExtractOptions& options, std::uint64_t& splatted);

}  // namespace kiln
