// Values of maps as files store them.
#pragma once

#include <vector>

#include "kiln/image_format.h"
#include "kiln/map.h"

namespace kiln {

/// True if a format stores unscaled floats: EXR, and TIFF of floats.
bool holds_floats(ImageFormat format);

/// Values of a map's channels that a format stores as 0 and 1; empty for formats that store unscaled floats.
std::vector<ValueRange> stored_ranges(const BakedMap& map, ImageFormat format);

}  // namespace kiln
