#include "lab/table.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <stdexcept>

#include "report/console.h"

namespace kiln::cli {
namespace {

using Row =
    std::map<std::string, std::string>;  // The cells of a row, by the names of their columns

bool is_true(const Json& value) { return value.dump() == "true"; }

std::string format_csv_cell(const Json& value) {
  if (value.is_string()) {
    const std::string& text = value.text();
    if (text.find_first_of(",\"\n\r") == text.npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
  }
  const std::string text = value.dump();
  if (text == "null") return {};
  if (text == "true" || text == "false") return text == "true" ? "1" : "0";
  const bool is_integer = text.find_first_not_of("-0123456789") == text.npos;
  return is_integer ? text : formatted("%.9g", value.number());
}

/// Adds the cells of a value to a row. Adds their columns if they are new.
void add_cells(const std::string& path, const Json& value, Row& row,
               std::vector<std::string>& columns) {
  if (value.is_array()) return;
  if (value.is_object()) {
    for (const std::string& key : value.keys()) {
      add_cells(path.empty() ? key : path + "." + key, value.at(key), row, columns);
    }
    return;
  }
  row[path] = format_csv_cell(value);
  if (std::find(columns.begin(), columns.end(), path) == columns.end()) columns.push_back(path);
}

std::string format_cell(const Column& column, const Json& row) {
  const Json& value = row.at(column.path);
  const std::string text = value.is_null() ? std::string()
                           : column.digits < 0
                               ? value.text()
                               : fixed_text(column.scale * value.number(), column.digits);
  if (column.starred_if.empty()) return text;
  return text + (is_true(row.at(column.starred_if)) ? " *" : "  ");
}

std::size_t count_columns(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80;
  }));
}

}  // namespace

std::string join(const std::vector<std::string>& parts, const char* between) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i) text += (i == 0 ? "" : between) + parts[i];
  return text;
}

std::string text_of(double value) { return formatted("%g", value); }

std::string fixed_text(double value, int digits) {
  constexpr double kMaxFixedValue =
      1e9;  // Larger numbers are written with an exponent instead of up to 40 digits
  return std::abs(value) < kMaxFixedValue ? formatted("%.*f", digits, value)
                                          : formatted("%.3g", value);
}

std::string count_text(const Json& number) {
  return with_commas(static_cast<std::uint64_t>(number.number()));
}

std::string markdown_text(const std::string& text) {
  std::string result;
  for (const char c : printable(text)) {
    if (std::string_view("|\\*_`[]!#~<>&").find(c) != std::string_view::npos) result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result;
}

Json fields(std::string_view keys, std::initializer_list<Json::Element> values) {
  Json json = Json::object();
  for (const Json::Element& value : values) {
    const std::size_t end = std::min(keys.find(' '), keys.size());
    if (end == 0) throw std::logic_error("more values than keys");
    json[keys.substr(0, end)] = value;
    keys.remove_prefix(std::min(end + 1, keys.size()));
  }
  if (!keys.empty()) throw std::logic_error("no value for " + std::string(keys));
  return json;
}

std::string csv(const Json& rows) {
  std::vector<std::string> columns;
  std::vector<Row> cells;
  for (const Json& row : rows.elements()) add_cells("", row, cells.emplace_back(), columns);
  std::string text = join(columns, ",") + "\n";
  for (Row& row : cells) {
    std::vector<std::string> line;
    for (const std::string& column : columns) line.push_back(row[column]);
    text += join(line, ",") + "\n";
  }
  return text;
}

std::vector<std::string> table_lines(const std::vector<Column>& columns, const Json& rows) {
  std::vector<std::string> lines(2 + rows.size(), "|");
  for (const Column& column : columns) {
    std::vector<std::string> cells = {column.heading, column.digits < 0 ? "---" : "--:"};
    for (const Json& row : rows.elements()) cells.push_back(format_cell(column, row));
    std::size_t width = 0;
    for (const std::string& cell : cells) width = std::max(width, count_columns(cell));
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string gap(width - count_columns(cells[i]), i == 1 ? '-' : ' ');
      lines[i] += " " + (column.digits < 0 ? cells[i] + gap : gap + cells[i]) + " |";
    }
  }
  return lines;
}

}  // namespace kiln::cli
