// Formats counts with their nouns for messages.
#pragma once

#include <cstdint>
#include <string>

namespace kiln {

/// A count and its noun: "1 triangle", "2 triangles".
inline std::string counted(std::uint64_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// A count and its noun, whose plural is irregular: "2 meshes".
inline std::string counted(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

/// Part of a message about an index that is too large: "there is only 1", "there are only 12", "there are
/// none".
inline std::string there_are_only(std::uint64_t count) {
  if (count == 0) return "there are none";
  return (count == 1 ? "there is only " : "there are only ") + std::to_string(count);
}

}  // namespace kiln
