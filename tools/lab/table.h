// Formats rows of figures as text. A row is a JSON object of the report. CSV contains all figures; a table contains
// those that its columns name.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "options/json.h"
#include "options/parse.h"

namespace kiln::cli {

std::string join(const std::vector<std::string>& parts, const char* between);
/// Formats a number in its shortest decimal form, such as "0.05" or "2000".
std::string text_of(double value);
/// Formats a number with a fixed number of decimals.
std::string fixed_text(double value, int digits);
/// Formats an integer of a report with commas between thousands.
std::string count_text(const Json& number);
/// Escapes the special characters of Markdown in a text.
std::string markdown_text(const std::string& text);

/// Makes a JSON object. \param keys  the keys, separated by spaces, in the order of the values
Json fields(std::string_view keys, std::initializer_list<Json::Element> values);

/// Formats rows as CSV, with a column for each number, boolean and string at any depth, named by its path
/// ("seconds.total"). Lists are omitted. Numbers have nine digits, booleans are 1 and 0, null is empty.
std::string csv(const Json& rows);

/// A column of a text table.
struct Column {
  std::string heading;
  std::string path;  ///< Path of the column's figure in a row
  int digits = -1;   ///< Number of decimals; -1: the column contains text
  double scale = 1;  ///< Factor from the figure to the number in the table
  std::string starred_if =
      {};  ///< Path of a boolean in a row; if it is true, the number is followed by *
};

/// Formats rows as a Markdown table with aligned columns, which is readable in terminals, too. Texts are not escaped.
std::vector<std::string> table_lines(const std::vector<Column>& columns, const Json& rows);

}  // namespace kiln::cli
