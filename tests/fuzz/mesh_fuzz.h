// One input of a mesh fuzzer: a reader gives a mesh that keeps its promises, or throws kiln::Error.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "asset/mesh_reader.h"
#include "support/mesh_check.h"

namespace kiln::test {

inline int fuzz_mesh(const std::uint8_t* data, std::size_t size, MeshFormat format) {
  std::vector<Warning> warnings;
  const MeshInput input{"input", {reinterpret_cast<const char*>(data), size}, &warnings};
  try {
    const std::string broken = broken_promise(parse_mesh(input, format));
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
