// Packs outlines by their bounding boxes, for triangle soups whose numbers are too large for bitmaps.
#pragma once

#include <cstdint>
#include <span>

#include "pack/bitmap_packing.h"

namespace kiln {

/// Like pack_outlines(), but packs the smallest bounding box of each outline, in O(n log n). About half of the square
/// is lost. Deterministic.
OutlinePacking pack_boxes(std::span<const Outline> outlines, std::uint32_t size, double padding);

}  // namespace kiln
