// Creases, where charts end.
#pragma once

#include "unwrap/chart_surface.h"

namespace kiln {

/// Parts a surface at long creases: a texel across one would have half of what each side has, and a renderer's filter
/// does that, too. Long ones between flats, and chains of them between smooth sides. Rough surfaces have sharp edges,
/// but hardly a smooth face beside one.
void part_at_creases(ChartSurface& surface);

}  // namespace kiln
