// Values of maps as files store them.
#pragma once

#include <vector>

#include "kiln/image_format.h"
#include "kiln/map.h"

namespace kiln {

/// True if files of a format store values as unscaled floats: EXR, and TIFF with float samples.
bool holds_floats(ImageFormat format);

/// The values that a format stores as 0 and as 1, for each channel of a map; empty for formats that
/// store unscaled floats.
std::vector<ValueRange> stored_ranges(const BakedMap& map, ImageFormat format);

}  // namespace kiln
