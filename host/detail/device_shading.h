// Shading frames of the low poly on the device.
#pragma once

#include "cl/context.h"
#include "mesh/low_shading.h"

namespace kiln {

/// low_shading() of the triangles with UVs; entries of other triangles, which no texel shows, are undefined. Of texture
/// sets, whose triangles mostly stand together, only the set's own entries are written.
cl::Array<kiln_low_shading> device_shading(cl::Context& context, const LowSurface& surface);

}  // namespace kiln
