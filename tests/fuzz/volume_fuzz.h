// One input of a volume fuzzer: a reader gives a volume that keeps its promises, or throws kiln::Error.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "io/volume/volume_reader.h"
#include "support/volume_check.h"

namespace kiln::test {

inline int fuzz_volume(const std::uint8_t* data, std::size_t size, VolumeFormat format) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto source = bytes_in_memory(bytes);
  std::vector<Warning> warnings;
  // Files of voxels hold the same bytes.
  const VolumeInput input{"input", source.get(), &warnings,
                          [bytes](const std::string&) { return bytes_in_memory(bytes); }};
  try {
    const std::string broken = broken_promise(parse_volume(input, format));
    if (!broken.empty()) {
      std::fprintf(stderr, "%s\n", broken.c_str());
      std::abort();
    }
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) std::abort();
  }
  return 0;
}

}  // namespace kiln::test
