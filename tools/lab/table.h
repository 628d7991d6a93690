// Figures as text: one writer of tables (CSV, Markdown), of JSON by columns, and of lines for people.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "arguments/parse.h"
#include "report/json.h"

namespace kiln::cli {

std::string join(const std::vector<std::string>& parts, const char* between);
/// A number as people write it: "0.05", "2000".
std::string text_of(double value);
/// With so many digits after the point.
std::string fixed_text(double value, int digits);
/// A text inside a table of Markdown.
std::string markdown_cell(const std::string& text);

/// An object of keys, with blanks between them, and as many values.
Json fields(std::string_view keys, std::initializer_list<Json::Element> values);

/// Rows of cells: numbers, truth values, texts and nulls.
class Table {
 public:
  /// \param columns  names, with | between them. For Markdown one begins with > or ^ where cells stand at the
  ///                 right or in the middle
  explicit Table(std::string_view columns);
  /// A cell a column.
  void add(std::initializer_list<Json::Element> cells) { add(Json::array(cells)); }
  void add(const Json& cells);

  /// Numbers of nine digits, truth values as 1 and 0, nothing for null.
  std::string csv() const;
  /// Cells are texts.
  std::string markdown() const;

 private:
  std::vector<std::string> columns_;
  std::vector<Json> rows_;
};

}  // namespace kiln::cli
