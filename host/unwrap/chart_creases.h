// Creases at which charts end.
#pragma once

#include "unwrap/chart_surface.h"

namespace kiln {

/// Separates a surface at long creases: a texel across a crease, or a texture filter there, would average the detail
/// of both sides. Long creases are single edges between flat triangles, and chains of edges between smooth sides.
/// Rough surfaces have sharp edges, too, but hardly any smooth triangle beside them.
void separate_at_creases(ChartSurface& surface);

}  // namespace kiln
