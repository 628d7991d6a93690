#include "io/file/bounds.h"

#include <utility>

#include "base/option.h"

namespace kiln {
namespace {

/// Largest number of unpacked bytes per packed byte, rounded up.
constexpr std::uint64_t max_unpack_ratio(Packing packing) {
  // Deflate (RFC 1951): the best code has one bit for a length of 258 and one for its distance, so
  // 8 bits unpack to 4 x 258 bytes.
  constexpr std::uint64_t kMaxDeflateRatio = 1032;
  switch (packing) {
    case Packing::none:
      return 1;
    case Packing::deflate:
      return kMaxDeflateRatio;
    case Packing::exr_rle:
      return 64;  // 2 packed bytes encode a run of at most 128 bytes
    case Packing::exr_piz:
      // PIZ: a run of at most 255 values of 2 bytes takes a Huffman code of at least one bit, and 8
      // bits for its length
      return 454;
    case Packing::exr_pxr24:
      return kMaxDeflateRatio * 4 / 3;  // PXR24 keeps and deflates 3 of a float's 4 bytes
    case Packing::exr_b44:
      return 11;  // 3 bytes encode a flat block of 4 x 4 values of 2 bytes
    case Packing::exr_dwa:
      // A block of 8 x 8 values of 4 bytes takes at least 2 bytes, which deflate compresses
      // further. Runs of deflated bytes unpack at a lower ratio.
      return kMaxDeflateRatio * 128;
  }
  return kMaxDeflateRatio;
}

}  // namespace

std::uint64_t max_unpacked_bytes(Packing packing, std::uint64_t packed) {
  return saturated_product(packed, max_unpack_ratio(packing));
}

MemoryFailure memory_failure(FailWith fail, std::string place) {
  return [fail = std::move(fail), place = std::move(place)](const std::string& problem) {
    fail(place, problem,
         "Free some memory, raise the " + option("memory_limit") + ", or make the file smaller.");
  };
}

}  // namespace kiln
