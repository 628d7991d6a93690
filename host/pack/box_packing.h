// Packs outlines by their bounding boxes, for triangle soups, whose outlines are too many for packing by bitmaps.
#pragma once

#include <cstdint>
#include <span>

#include "pack/bitmap_packing.h"

namespace kiln {

/// Packs as pack_outlines(), but uses the smallest bounding box of each outline, in O(n log n). About half of the
/// square remains empty. Deterministic.
OutlinePacking pack_boxes(std::span<const Outline> outlines, std::uint32_t size, double padding);

}  // namespace kiln
