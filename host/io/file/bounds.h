// Bounds of sizes that follow from a file's content and from available memory. They are checked
// before memory is allocated.
#pragma once

#include <cstdint>
#include <string>

#include "base/memory.h"
#include "io/file/byte_source.h"

namespace kiln {

/// Compression methods in files.
enum class Packing {
  none,
  deflate,  ///< zlib, gzip, PNG, OpenEXR's ZIP and ZIPS
  exr_rle,
  exr_piz,
  exr_pxr24,
  exr_b44,  ///< B44 and B44A
  exr_dwa,  ///< DWAA and DWAB
};

/// Upper bound of the unpacked size of `packed` bytes, from the format's definition; at most
/// 2^64 - 1. The derivations are in the source.
std::uint64_t max_unpacked_bytes(Packing packing, std::uint64_t packed);

/// Limits on an image in a file, in addition to those that follow from the file's size.
struct ImageLimits {
  /// Largest number of pixels. A height field of 2^30 pixels would exceed the limit on triangles.
  std::uint64_t pixels = (std::uint64_t{1} << 30) - 1;
};

/// Makes the error that a reader reports if memory is insufficient; an argument of
/// require_memory().
/// \param place  place in the file, such as "dataWindow"
MemoryFailure memory_failure(FailWith fail, std::string place);

}  // namespace kiln
