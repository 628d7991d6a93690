// Shading frames of the low poly on the device.
#pragma once

#include "cl/context.h"
#include "mesh/low_shading.h"

namespace kiln {

/// Uploads low_shading() of the triangles with UVs; entries of other triangles, which no texel shows, are undefined.
/// For a texture set, only the entries of the set's triangles are written; these are mostly consecutive.
cl::Array<kiln_low_shading> device_shading(cl::Context& context, const LowSurface& surface);

}  // namespace kiln
