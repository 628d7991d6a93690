// Counts in sentences.
#pragma once

#include <cstdint>
#include <string>

namespace kiln {

/// "1 triangle", "2 triangles": a count and its noun.
inline std::string counted(std::uint64_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace kiln
