// Creases at which charts end.
#pragma once

#include "unwrap/chart_surface.h"

namespace kiln {

/// Separates a surface at long creases, so that charts end there: a texel across a crease, or a texture filter there,
/// would average the detail of both sides. A long crease is either a single edge between flat triangles, or a chain of
/// edges between smooth sides. Rough surfaces have sharp edges, too, but hardly any smooth triangles beside them.
void separate_at_creases(ChartSurface& surface);

}  // namespace kiln
