// Packing of many outlines as bitmaps.
#pragma once

#include <cstdint>
#include <span>

#include "pack/bitmap_packing.h"

namespace kiln {

/// As pack_outlines(), for hundreds or thousands of outlines: on fine cells, in few orders.
/// Falls back to pack_boxes() if that packs better. Deterministic on any number of threads.
OutlinePacking pack_many(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         int threads = 0);

}  // namespace kiln
