#include "report/json_text.h"

#include <cctype>
#include <cstdint>

namespace kiln::cli {
namespace {

bool is_escape(std::string_view text) {
  const auto digit = [&](std::size_t i) {
    return std::isxdigit(static_cast<unsigned char>(text[i])) != 0;
  };
  return text.size() >= 4 && text[0] == '\\' && text[1] == 'x' && digit(2) && digit(3);
}

unsigned value_of(char digit) {
  const auto c = static_cast<unsigned char>(digit);
  return c <= '9' ? c - '0' : static_cast<unsigned>(std::tolower(c)) - 'a' + 10U;
}

}  // namespace

std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return 0;
  }
  const unsigned second = byte(1);
  const bool bad = (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
                   (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F);
  return bad ? 0 : length;
}

std::string escape_bytes(std::string_view bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(bytes.size());
  while (!bytes.empty()) {
    const std::size_t length = is_escape(bytes) ? 0 : utf8_length(bytes);
    if (length == 0) {
      const auto byte = static_cast<unsigned char>(bytes[0]);
      text += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
    } else {
      text += bytes.substr(0, length);
    }
    bytes.remove_prefix(length == 0 ? 1 : length);
  }
  return text;
}

std::string unescape_bytes(std::string_view text) {
  std::string bytes;
  while (!text.empty()) {
    const bool escape = is_escape(text);
    bytes += escape ? static_cast<char>(16 * value_of(text[2]) + value_of(text[3])) : text[0];
    text.remove_prefix(escape ? 4 : 1);
  }
  return bytes;
}

std::string to_text(const Json& json) { return json.with_texts(escape_bytes).dump(2) + "\n"; }

}  // namespace kiln::cli
