// TOML as a value with line numbers. It hides toml++, whose headers add seconds to the compile time of each file that
// includes them; only toml.cpp does.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// A value of a TOML file, with its line.
struct TomlValue {
  enum class Kind : std::uint8_t { text, whole, number, truth, date, list, table };

  Kind kind = Kind::table;
  std::string text;                 ///< Text of scalars: "0.5", "true"; of strings without quotes
  std::vector<TomlValue> elements;  ///< Elements of a list, or values of a table
  std::vector<std::string> keys;    ///< Keys of a table, in the order of the file
  std::uint32_t line = 0;           ///< Starts at 1

  bool is_table() const { return kind == Kind::table; }
  bool is_list() const { return kind == Kind::list; }
  bool is_text() const { return kind == Kind::text; }
  /// The value of a key; null if there is none.
  const TomlValue* find(std::string_view key) const;
  /// "a text", "a list", for messages.
  const char* kind_name() const;
};

/// \param file  for messages \throws Error(usage) "FILE:LINE:COLUMN: ..." for invalid or too deeply nested TOML
TomlValue parse_toml(std::string_view text, const std::string& file);

/// Quotes and escapes a text as a TOML string.
std::string toml_quoted(std::string_view text);

}  // namespace kiln
