#include "lab/table.h"

#include <cmath>
#include <stdexcept>
#include <string_view>

#include "arguments/parse.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

std::vector<std::string> split(std::string_view text, char between) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    c == between ? void(parts.emplace_back()) : parts.back().push_back(c);
  }
  return parts;
}

/// Alike, or the program is wrong: a column has another's values then.
void check_count(std::size_t columns, std::size_t values) {
  if (columns == values) return;
  throw std::logic_error("a table of " + std::to_string(columns) + " columns was given a row of " +
                         std::to_string(values));
}

std::string csv_cell(const Json& cell) {
  if (cell.is_string()) {
    const std::string& text = cell.text();
    if (text.find_first_of(",\"\n\r") == text.npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
  }
  const std::string text = cell.dump();
  if (text == "null") return {};
  if (text == "true" || text == "false") return text == "true" ? "1" : "0";
  const bool whole = text.find_first_not_of("-0123456789") == text.npos;
  return whole ? text : formatted("%.9g", cell.number());
}

}  // namespace

std::string join(const std::vector<std::string>& parts, const char* between) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i) text += (i == 0 ? "" : between) + parts[i];
  return text;
}

std::string text_of(double value) { return formatted("%g", value); }

std::string fixed_text(double value, int digits) {
  constexpr double kMost = 1e9;  // of 40 digits nobody reads any
  return std::abs(value) < kMost ? formatted("%.*f", digits, value) : formatted("%.3g", value);
}

std::string markdown_cell(const std::string& text) {
  std::string result;
  for (const char c : printable(text)) {
    if (std::string_view("|\\*_`[]!#~<>&").find(c) != std::string_view::npos) result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result;
}

Json fields(std::string_view keys, std::initializer_list<Json::Element> values) {
  const std::vector<std::string> names = split(keys, ' ');
  check_count(names.size(), values.size());
  Json json = Json::object();
  for (std::size_t i = 0; i < names.size(); ++i) json[names[i]] = values.begin()[i];
  return json;
}

Table::Table(std::string_view columns) : columns_(split(columns, '|')) {}

void Table::add(const Json& cells) {
  check_count(columns_.size(), cells.size());
  rows_.push_back(cells);
}

std::string Table::csv() const {
  std::string text = join(columns_, ",") + "\n";
  for (const Json& row : rows_) {
    std::vector<std::string> cells;
    for (const Json& cell : row.elements()) cells.push_back(csv_cell(cell));
    text += join(cells, ",") + "\n";
  }
  return text;
}

std::string Table::markdown() const {
  std::string text = "|", rule = "|";
  for (const std::string& column : columns_) {
    const char side = column.empty() ? ' ' : column[0];
    const std::string title = side == '>' || side == '^' ? column.substr(1) : column;
    text += (title.empty() ? "" : " " + title) + " |";
    rule += side == '>' ? " --: |" : side == '^' ? " :-: |" : " --- |";
  }
  text += "\n" + rule + "\n";
  for (const Json& row : rows_) {
    text += "|";
    for (const Json& cell : row.elements()) text += " " + cell.text() + " |";
    text += "\n";
  }
  return text;
}

}  // namespace kiln::cli
