// Creases at which charts end.
#pragma once

#include "unwrap/chart_surface.h"

namespace kiln {

/// Separates a surface at long creases: a texel across a crease would average both sides' detail, and so would a
/// texture filter. Long creases are single edges between flat triangles, and chains of edges between smooth sides.
/// Rough surfaces have sharp edges, too, but hardly any smooth triangle beside them.
void separate_at_creases(ChartSurface& surface);

}  // namespace kiln
