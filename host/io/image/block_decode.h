// Decompression of blocks of 4 x 4 texels: BC1 to BC5 and BC7 (Direct3D 11.3, section 19.5).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace kiln {

enum class BlockFormat { bc1, bc2, bc3, bc4, bc4_signed, bc5, bc5_signed, bc7 };

/// Number of bytes of a block: 8 or 16.
std::size_t block_bytes(BlockFormat format);
/// Number of channels of a format: 1 (BC4), 2 (BC5) or 4.
std::uint32_t block_channels(BlockFormat format);

/// The texels of a block by rows, with four channels each. Missing channels are 0, a missing alpha
/// is 1.
using BlockTexels = std::array<std::array<float, 4>, 16>;

/// Decodes a block to values in [0, 1]; a signed value n becomes n/2 + 1/2. BC7's reserved mode
/// gives zeros, as the specification says.
/// \param block  block_bytes() bytes
void decode_block(BlockFormat format, const std::uint8_t* block, BlockTexels& texels);

}  // namespace kiln
