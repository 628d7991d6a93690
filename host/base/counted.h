// Counts with their nouns, in messages.
#pragma once

#include <cstdint>
#include <string>

namespace kiln {

/// A count and its noun: "1 triangle", "2 triangles".
inline std::string counted(std::uint64_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// The same for a noun with an irregular plural: "2 meshes".
inline std::string counted(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace kiln
