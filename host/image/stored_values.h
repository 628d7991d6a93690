// Values of maps as files store them.
#pragma once

#include <vector>

#include "kiln/map.h"

namespace kiln {

/// True if a format stores values as they are: EXR, and TIFF of floats.
bool holds_floats(ImageFormat format);

/// Values of a map's channels that a format stores as 0 and 1; empty where it stores them as they are.
std::vector<ValueRange> stored_ranges(const BakedMap& map, ImageFormat format);

}  // namespace kiln
