// Rows of figures as text. A row is an object of JSON, as the report has it: CSV has all of its figures, a table for
// people those that its columns name.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "options/json.h"
#include "options/parse.h"

namespace kiln::cli {

std::string join(const std::vector<std::string>& parts, const char* between);
/// A number as people write it: "0.05", "2000".
std::string text_of(double value);
/// With so many digits after the point.
std::string fixed_text(double value, int digits);
/// A whole number of a report, with commas between thousands.
std::string count_text(const Json& number);
/// A text within Markdown.
std::string markdown_text(const std::string& text);

/// An object of keys, with blanks between them, and as many values.
Json fields(std::string_view keys, std::initializer_list<Json::Element> values);

/// Rows as comma-separated values: a column for each number, truth value and text, however deep, named by its path
/// ("seconds.total"). Lists are left out. Numbers have nine digits, truth values are 1 and 0, null is empty.
std::string csv(const Json& rows);

/// A column of a table for people.
struct Column {
  std::string heading;
  std::string path;       ///< To its figure in a row
  int digits = -1;        ///< After a number's point; -1: it holds texts
  double scale = 1;       ///< Numbers are shown times this
  std::string star = {};  ///< The path to a truth value that puts * after the figure
};

/// A Markdown table with its columns aligned, so that terminals show it, too. Texts are put in as they are.
std::vector<std::string> table_lines(const std::vector<Column>& columns, const Json& rows);

}  // namespace kiln::cli
