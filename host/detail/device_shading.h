// Shading frames of the low poly on the device.
#pragma once

#include "cl/context.h"
#include "mesh/low_shading.h"

namespace kiln {

/// Uploads the result of low_shading() for the triangles that have UVs. Entries of other triangles
/// are undefined, since no texel shows these triangles. If only one texture set is baked, only the
/// entries of its triangles are written; these are mostly consecutive.
cl::Array<kiln_low_shading> device_shading(cl::Context& context, const LowSurface& surface);

}  // namespace kiln
