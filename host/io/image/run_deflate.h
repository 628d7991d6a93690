// Deflate for filtered pixels: runs of one byte and Huffman codes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kiln {

/// A piece of a deflate stream (RFC 1951): blocks of dynamic Huffman codes over literals and runs of the previous
/// byte (distance 1), as zlib's strategy Z_RLE writes. The piece ends at a byte boundary, so that separately deflated
/// pieces can be concatenated.
/// \param last  true for the last piece of the stream
/// \param to    the piece is appended to it Cost: less than half of the time of zlib's Z_RLE. The size of maps is
/// within 1%; data that is nearly empty, or changes character within 64 KiB, is larger.
void run_deflate(std::span<const std::uint8_t> raw, bool last, std::vector<std::uint8_t>& to);

}  // namespace kiln
