// Packing of many outlines by their boxes: for soups, where bitmaps would take too long.
#pragma once

#include <cstdint>
#include <span>

#include "pack/bitmap_packing.h"

namespace kiln {

/// As pack_outlines, but each outline takes its smallest box: n log n, and about half of the square is
/// lost. Deterministic.
OutlinePacking pack_boxes(std::span<const Outline> outlines, std::uint32_t size, double padding);

}  // namespace kiln
