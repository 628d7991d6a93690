// Limits the nesting of JSON text before it is parsed.
#pragma once

#include <cstddef>
#include <string_view>

namespace kiln {

/// Maximum nesting depth of JSON that Kiln reads and writes. JSON values are destroyed, copied and written
/// recursively, so deeper nesting would overflow the stack. Exporters write at most tens of levels.
inline constexpr std::size_t kMaxJsonDepth = 200;

/// True if a JSON text nests lists and objects deeper than kMaxJsonDepth. For invalid JSON, true only if a parser
/// would reach that depth before it fails. Runs in one pass without allocations.
inline bool is_nested_too_deep(std::string_view json) {
  std::size_t depth = 0;
  bool is_in_string = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (is_in_string) {
      if (c == '\\') ++i;
      if (c == '"') is_in_string = false;
    } else if (c == '"') {
      is_in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kMaxJsonDepth) return true;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return false;
}

}  // namespace kiln
