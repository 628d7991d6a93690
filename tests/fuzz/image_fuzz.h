// One input of an image fuzzer: a reader gives an image that keeps its promises, or throws kiln::Error.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "io/image/image_reader.h"
#include "kiln/error.h"

namespace kiln::test {

/// Few enough pixels that an input takes milliseconds and megabytes.
inline constexpr ImageLimits kFuzzLimits{std::uint64_t{1} << 20};

/// Calls read(source); aborts at any other error than that of an input. \returns 0, for libFuzzer
template <typename Read>
int fuzz_bytes(const std::uint8_t* data, std::size_t size, const Read& read) {
  const auto source = bytes_in_memory({reinterpret_cast<const char*>(data), size});
  try {
    read(*source);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) std::abort();
  }
  return 0;
}

inline void check_image(const Image& image) {
  const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
  if (pixels == 0 || pixels > kFuzzLimits.pixels || image.channels < 1 || image.channels > 4 ||
      image.pixels.size() != pixels * image.channels) {
    std::abort();
  }
}

}  // namespace kiln::test
