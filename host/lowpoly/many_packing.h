// Packing of many outlines as bitmaps.
#pragma once

#include <cstdint>
#include <span>

#include "lowpoly/bitmap_packing.h"

namespace kiln {

/// As pack_outlines(), for hundreds or thousands of outlines: on fine cells, in few orders, none pressed.
/// Where boxes pack better, it is pack_boxes(). Deterministic on any number of threads.
OutlinePacking pack_many(std::span<const Outline> outlines, std::uint32_t size, double padding,
                         int threads = 0);

}  // namespace kiln
