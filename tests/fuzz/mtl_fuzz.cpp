#include <cstdint>
#include <cstdlib>
#include <vector>

#include "io/mesh/materials.h"

/// Materials come, or kiln::Error of an input.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<kiln::Warning> warnings;
  try {
    kiln::read_materials({"input", {reinterpret_cast<const char*>(data), size}, &warnings},
                         "folder");
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return 0;
}
