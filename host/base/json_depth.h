// Nesting of JSON text, counted before it is parsed.
#pragma once

#include <cstddef>
#include <string_view>

namespace kiln {

/// Lists and objects within each other that Kiln reads and writes. A value of JSON is destroyed, copied and written by
/// functions that call themselves once a level: text that is nested further would end in a stack overflow. No exporter
/// writes more than some tens of levels.
inline constexpr std::size_t kMostJsonDepth = 200;

/// True if lists and objects of a JSON text lie in more than kMostJsonDepth others. Of text that is no JSON it says so
/// only if a parser would come to that depth before it fails. Takes one pass and no memory.
inline bool is_nested_too_deep(std::string_view json) {
  std::size_t depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_text) {
      if (c == '\\') ++i;
      if (c == '"') in_text = false;
    } else if (c == '"') {
      in_text = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kMostJsonDepth) return true;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return false;
}

}  // namespace kiln
