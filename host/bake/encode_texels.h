// The last step of a map: background and encoding.
#pragma once

#include <cstdint>
#include <span>

#include "detail/registry.h"

namespace kiln {

/// Fills texels beyond the padding with the background, and encodes the values of all texels.
void encode_texels(const MapInfo& map, const BakeOptions& options,
                   std::span<const std::uint8_t> coverage, Image& image);

}  // namespace kiln
