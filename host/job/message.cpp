// Spells options in messages as flags, Python keywords or members.
#include "kiln/message.h"

#include <algorithm>
#include <array>

#include "job/job_options.h"
#include "kiln/option_error.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// Flags and keywords that cannot be derived from the name: of options whose flag is not simply the last word of the
/// name, and of functions, which are not members of a job.
struct SpecialSpelling {
  std::string_view name, flag, keyword;
};
constexpr std::array kSpellings = {
    SpecialSpelling{"keep_topology", "--topology", "keep_topology"},
    SpecialSpelling{"match.saved", "--load-match", "match"},
    SpecialSpelling{"outer_only", "--outer", "outer_only"},
    SpecialSpelling{"save_match()", "--save-match", "kiln.Match.save()"},
    SpecialSpelling{"simplify()", "`kiln bake` without LOW", "kiln.simplify()"},
    SpecialSpelling{"unwrap()", "`kiln bake --unwrap`", "kiln.unwrap()"},
};

const SpecialSpelling* find_spelling(std::string_view name) {
  const auto* const found = std::find_if(kSpellings.begin(), kSpellings.end(),
                                         [&](const SpecialSpelling& s) { return s.name == name; });
  return found == kSpellings.end() ? nullptr : found;
}

/// The option's flag without leading dashes and with underscores: "max_distance" for "match.max_distance".
std::string keyword_of(std::string_view name) {
  const OptionRow* const row = find_option(name);
  if (row == nullptr) return std::string(name.substr(name.rfind('.') + 1));
  std::string key = lower_case(row->flag.substr(row->flag.find_first_not_of('-')));
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

}  // namespace

void fail_usage(const Message& message) {
  if (message.has_options()) throw OptionError(message);
  throw Error(ErrorCode::usage, message);
}

Message option_of(std::string_view flag, std::string_view value) {
  std::string name(flag.substr(std::min(flag.find_first_not_of('-'), flag.size())));
  std::replace(name.begin(), name.end(), '-', '_');
  return Message::option(name, value);
}

std::string option_as_flag(std::string_view name, std::string_view value) {
  std::string text;
  if (const SpecialSpelling* const other = find_spelling(name)) {
    text = other->flag;
  } else {
    text = "--" + keyword_of(name);
    std::replace(text.begin(), text.end(), '_', '-');
  }
  return value.empty() ? text : text + " " + std::string(value);
}

std::string option_as_keyword(std::string_view name, std::string_view value) {
  const SpecialSpelling* const other = find_spelling(name);
  const std::string text = other != nullptr ? std::string(other->keyword) : keyword_of(name);
  if (value.empty()) return text;
  double number = 0;
  const bool is_plain = read_number(value, number);
  return text + "=" + (is_plain ? std::string(value) : "\"" + std::string(value) + "\"");
}

std::string option_as_member(std::string_view name, std::string_view value) {
  const OptionRow* const row = find_option(name);
  std::string member = row == nullptr ? std::string(name) : row->value.member;
  member = member.substr(0, member.find(','));
  if (row != nullptr) member = "job." + member;
  return value.empty() ? member : member + " = " + std::string(value);
}

}  // namespace kiln
