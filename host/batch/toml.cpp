#include "batch/toml.h"

#define TOML_ENABLE_FORMATTERS 0
#define TOML_ENABLE_WINDOWS_COMPAT 0
// toml++ 3.3 asserts that a key begins with a valid character, and without assertions lets Clang assume it; malformed
// files violate that, and the parser reports them a few lines later. So it neither asserts nor assumes here.
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(condition) static_cast<void>(0)
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "kiln/error.h"

namespace kiln {
namespace {

/// Maximum number of parts of one key, such as "a.b.c". toml++ destroys tables recursively, so a key of a million
/// parts would overflow the stack. toml++ itself limits the depth of lists and inline tables.
constexpr std::size_t kMaxKeyParts = 16;

[[noreturn]] void fail_at(const std::string& file, std::size_t line, std::size_t column,
                          const std::string& problem) {
  throw Error(ErrorCode::usage,
              file + ":" + std::to_string(line) + ":" + std::to_string(column) + ": " + problem);
}

/// Skips a string that begins at a quote. \returns the position after its end, or the text's end
std::size_t skip_string(std::string_view text, std::size_t at, std::size_t& line) {
  const char quote = text[at];
  const std::string three(3, quote);
  const bool many = text.substr(at, 3) == three;
  at += many ? 3 : 1;
  while (at < text.size()) {
    if (text[at] == '\n') {
      if (!many) return at;  // Invalid TOML, which the parser will report
      ++line;
    }
    if (quote == '"' && text[at] == '\\') {
      at += 2;
      continue;
    }
    if (many ? text.substr(at, 3) == three : text[at] == quote) return at + (many ? 3 : 1);
    ++at;
  }
  return text.size();
}

void check_key_parts(std::string_view text, const std::string& file) {
  std::size_t parts = 0, line = 1;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '"' || c == '\'') {
      at = skip_string(text, at, line);
      continue;
    }
    if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
      continue;
    }
    if (c == '\n') ++line;
    if (c == '.' && ++parts >= kMaxKeyParts) {
      fail_at(file, line, 1,
              "a key has more than " + std::to_string(kMaxKeyParts) +
                  " parts, but no option of Kiln has so many: shorten it.");
    }
    if (c == '\n' || c == '=' || c == '[' || c == ']' || c == '{' || c == '}' || c == ',')
      parts = 0;
    ++at;
  }
}

std::string number_text(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
  std::array<char, 64> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

TomlValue value_of(const toml::node& node) {
  using Kind = TomlValue::Kind;
  TomlValue value;
  value.line = node.source().begin.line;
  if (const toml::table* const table = node.as_table()) {
    // toml++ sorts keys by name; their positions restore the order of the file.
    std::vector<std::pair<std::string, TomlValue>> members;
    std::vector<toml::source_position> places;
    for (const auto& [key, child] : *table) {
      places.push_back(key.source().begin);
      members.emplace_back(std::string(key.str()), value_of(child));
      members.back().second.line = key.source().begin.line;
    }
    std::vector<std::size_t> order(members.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return places[a] < places[b]; });
    for (const std::size_t i : order) {
      value.keys.push_back(members[i].first);
      value.elements.push_back(std::move(members[i].second));
    }
  } else if (const toml::array* const list = node.as_array()) {
    value.kind = Kind::list;
    for (const toml::node& element : *list) value.elements.push_back(value_of(element));
  } else if (const auto* const text = node.as_string()) {
    value.kind = Kind::text;
    value.text = text->get();
  } else if (const auto* const integer = node.as_integer()) {
    value.kind = Kind::whole;
    value.text = std::to_string(integer->get());
  } else if (const auto* const number = node.as_floating_point()) {
    value.kind = Kind::number;
    value.text = number_text(number->get());
  } else if (const auto* const truth = node.as_boolean()) {
    value.kind = Kind::truth;
    value.text = truth->get() ? "true" : "false";
  } else {
    value.kind = Kind::date;
    value.text = "date";
  }
  return value;
}

}  // namespace

const TomlValue* TomlValue::find(std::string_view key) const {
  const auto found = std::find(keys.begin(), keys.end(), key);
  return found == keys.end() ? nullptr : &elements[static_cast<std::size_t>(found - keys.begin())];
}

const char* TomlValue::kind_name() const {
  switch (kind) {
    case Kind::text:
      return "a text";
    case Kind::whole:
      return "a whole number";
    case Kind::number:
      return "a number";
    case Kind::truth:
      return "true or false";
    case Kind::date:
      return "a date";
    case Kind::list:
      return "a list";
    case Kind::table:
      break;
  }
  return "a table";
}

TomlValue parse_toml(std::string_view text, const std::string& file) {
  check_key_parts(text, file);
  try {
    return value_of(toml::parse(text, std::string_view(file)));
  } catch (const toml::parse_error& error) {
    const toml::source_position position = error.source().begin;
    const std::string_view problem = error.description();
    const bool escape = problem.find("escape sequence") != std::string_view::npos;
    fail_at(file, position.line, position.column,
            "this is not valid TOML: " + std::string(problem) + "." +
                (escape ? std::string(" ") + kBackslashRemedy : ""));
  }
}

std::string toml_quoted(std::string_view text) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (byte < 0x20 || byte == 0x7F) {
      quoted += std::string("\\u00") + kDigits[byte >> 4U] + kDigits[byte & 15U];
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

}  // namespace kiln
