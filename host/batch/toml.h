// A TOML value with line numbers. It hides toml++: only toml.cpp includes its headers, which add seconds to compile
// times.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// A value of a TOML file, with its line.
struct TomlValue {
  enum class Kind : std::uint8_t { text, integer, number, boolean, date, list, table };

  Kind kind = Kind::table;
  std::string text;  ///< Text of a scalar, such as "0.5" or "true"; strings have no quotes
  std::vector<TomlValue> elements;  ///< Elements of a list, or values of a table
  std::vector<std::string> keys;    ///< Keys of a table, in the order of the file
  std::uint32_t line = 0;           ///< Line of the value, from 1 on

  bool is_table() const { return kind == Kind::table; }
  bool is_list() const { return kind == Kind::list; }
  bool is_text() const { return kind == Kind::text; }
  /// Finds the value of a key; null if there is none.
  const TomlValue* find(std::string_view key) const;
  /// Returns the kind of the value for messages, such as "a text" or "a list".
  const char* kind_name() const;
};

/// Remedy in messages about Windows paths in double quotes, in which TOML reads a backslash as an escape.
inline constexpr const char* kBackslashRemedy =
    "In a path, write / for \\, or put it in single quotes.";

/// Parses a TOML file.
/// \param file  file name for messages
/// \throws Error(usage) "FILE:LINE:COLUMN: ..." for invalid or too deeply nested TOML
TomlValue parse_toml(std::string_view text, const std::string& file);

/// Quotes and escapes a text as a TOML string.
std::string toml_quoted(std::string_view text);

}  // namespace kiln
