// Counts in sentences.
#pragma once

#include <cstdint>
#include <string>

namespace kiln {

/// "1 triangle", "2 triangles": a count and its noun.
inline std::string counted(std::uint64_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// The same of a noun whose plural is not an "s" more: "2 meshes".
inline std::string counted(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace kiln
