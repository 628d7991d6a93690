// How near a light mesh's rendered normals come to the dense mesh's.
#pragma once

#include "kiln/kiln.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {

/// Measures how near the light mesh comes to the reference, from the view shown and along the six axes,
/// says so, and returns it for the report. The same pixels whatever the picture's own size.
Json measure_rendered(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
                      const RenderOptions& options, bool has_map);

/// The same from directions all around, none of them along an axis, from which flat faces look as straight
/// down as they were baked.
Json measure_around(const Scene& high, const Scene& low, const Mesh& frame, bool z_up);

}  // namespace kiln::cli
