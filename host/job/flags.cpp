#include "job/flags.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "job/job_options.h"

namespace kiln {

bool has_member(const OptionRow& row, std::string_view name) {
  std::string_view rest = row.value.member;
  for (;;) {
    const std::size_t comma = rest.find(", ");
    std::string_view member = rest.substr(0, comma);
    if (member == name) return true;
    if (member.starts_with("bake.") && member.substr(5) == name) return true;
    if (comma == std::string_view::npos) return false;
    rest.remove_prefix(comma + 2);
  }
}

namespace {

/// Names that are no members of a bake's options, and whose flags have other names.
struct Other {
  std::string_view name, flag;
};
constexpr std::array kOthers = {
    Other{"keep_topology", "--topology"},
    Other{"match.saved", "--load-match"},
    Other{"outer_only", "--outer"},
    Other{"save_match()", "--save-match"},
    Other{"simplify()", "`kiln bake` without LOW"},
    Other{"unwrap()", "`kiln bake --unwrap`"},
};

/// Empty: it names no option.
std::string flag_of(std::string_view name) {
  for (const Other& other : kOthers) {
    if (other.name == name) return std::string(other.flag);
  }
  for (const OptionRow& row : bake_rows()) {
    if (has_member(row, name)) return row.flag;
  }
  const auto is_part = [](char c) { return (c >= 'a' && c <= 'z') || c == '_' || c == '.'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(), is_part)) return {};
  std::string words(name.substr(name.rfind('.') + 1));
  std::replace(words.begin(), words.end(), '_', '-');
  return "--" + words;
}

}  // namespace

std::string with_flags(std::string_view message) {
  std::string text;
  std::size_t at = 0;
  for (;;) {
    const std::size_t open = message.find('`', at);
    const std::size_t close = open == message.npos ? open : message.find('`', open + 1);
    if (close == message.npos) return text.append(message.substr(at));
    text += message.substr(at, open - at);
    // After a quote it is a part of somebody's name.
    const bool starts = open == 0 || message[open - 1] == ' ' || message[open - 1] == '(';
    const std::string ours = starts ? flag_of(message.substr(open + 1, close - open - 1)) : "";
    text += ours.empty() ? "`" : ours;
    at = ours.empty() ? open + 1 : close + 1;
  }
}

}  // namespace kiln
