// Bounds by what a file can hold and memory can take: asked before memory is taken.
#pragma once

#include <cstdint>
#include <string>

#include "base/memory.h"
#include "io/file/byte_source.h"

namespace kiln {

/// Ways of packing bytes in a file.
enum class Packing {
  none,
  deflate,  ///< zlib, gzip, PNG, OpenEXR's ZIP and ZIPS
  exr_rle,
  exr_piz,
  exr_pxr24,
  exr_b44,  ///< And B44A
  exr_dwa,  ///< DWAA and DWAB
};

/// No `packed` bytes unpack to more than this, whatever they are: a bound from the format itself, not
/// from experience. At most 2^64 - 1. Where the numbers come from: the source.
std::uint64_t most_unpacked(Packing packing, std::uint64_t packed);

/// Limits of an image in a file, beside what the file can hold.
struct ImageLimits {
  /// Most pixels of one image; a height field of 2^30 would have more triangles than Kiln takes.
  std::uint64_t pixels = (std::uint64_t{1} << 30) - 1;
};

/// A reader's error that memory is short, for require_memory(). \param place  such as "dataWindow"
MemoryFailure memory_failure(FailWith fail, std::string place);

}  // namespace kiln
