// TOML as a value whose parts know their lines. The library behind it (toml++, in toml.cpp alone) takes compilers
// seconds for each file that includes its headers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// A value of a TOML file, and where it stands.
struct TomlValue {
  enum class Kind : std::uint8_t { text, whole, number, truth, date, list, table };

  Kind kind = Kind::table;
  std::string text;  ///< Of all but lists and tables: "0.5", "true"; of texts without quotes
  std::vector<TomlValue> elements;  ///< Of a list; of a table its values
  std::vector<std::string> keys;    ///< Of a table, in the order of the file
  std::uint32_t line = 0;           ///< From 1 on

  bool is_table() const { return kind == Kind::table; }
  bool is_list() const { return kind == Kind::list; }
  bool is_text() const { return kind == Kind::text; }
  /// Null: the table has no such key.
  const TomlValue* find(std::string_view key) const;
  /// "a text", "a list", for messages.
  const char* kind_name() const;
};

/// \param file  for messages \throws Error(usage) "FILE:LINE:COLUMN: ..." for what is no TOML, or nested too deep
TomlValue parse_toml(std::string_view text, const std::string& file);

/// A text as TOML has it, between double quotes.
std::string toml_quoted(std::string_view text);

}  // namespace kiln
