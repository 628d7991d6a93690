#include "options/values.h"

#include <charconv>
#include <cmath>

#include "base/formatted.h"
#include "options/near_words.h"
#include "options/parse.h"

namespace kiln {

template <typename Number>
bool read_number(std::string_view text, Number& value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}
template bool read_number(std::string_view, double&);
template bool read_number(std::string_view, std::int64_t&);
template bool read_number(std::string_view, std::uint32_t&);

namespace {

template <typename Number>
Check make_range_check(Number low, Number high) {
  const auto least = static_cast<double>(low), most = static_cast<double>(high);
  const std::string text =
      std::isinf(most) ? formatted("%.9g or more", least) : formatted("%.9g to %.9g", least, most);
  return {[=](const std::string& value) -> std::string {
            Number number = 0;
            if (read_number(value, number) && number >= low && number <= high) return {};
            return " is '" + value + "': give " + text;
          },
          text};
}

}  // namespace

Check range(double low, double high) { return make_range_check(low, high); }
Check range(unsigned low, unsigned high) { return make_range_check(low, high); }
Check one_of(const std::vector<std::string>& names) {
  std::string words = "{";
  for (const std::string& name : names) words += (words.size() == 1 ? "" : ",") + name;
  return {[names](std::string& value) -> std::string {
            const std::size_t first = value.find_first_not_of(' ');
            if (first != value.npos) {
              value = value.substr(first, value.find_last_not_of(' ') + 1 - first);
            }
            for (const std::string& name : names) {
              if (lower_case(name) != lower_case(value)) continue;
              value = name;
              return {};
            }
            return ": " + unknown_word_error(value, names);
          },
          words + "}"};
}

}  // namespace kiln
