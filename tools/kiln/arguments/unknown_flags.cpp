#include "arguments/unknown_flags.h"

#include <algorithm>
#include <sstream>
#include <string_view>
#include <vector>

#include "options/near_words.h"

namespace kiln::cli {

extern const char kUnknownFlags[];  // the contents of unknown_flags.txt, embedded by CMakeLists.txt

namespace {

/// Finds the explanation of a flag in unknown_flags.txt; empty if there is none. \param heading  "bake", "chart" or
/// "faces"
std::string find_explanation(std::string_view heading, std::string_view name) {
  std::istringstream explanation_lines{std::string(kUnknownFlags)};
  bool is_in_section = false;
  for (std::string line; std::getline(explanation_lines, line);) {
    if (line.starts_with('[')) is_in_section = line == "[" + std::string(heading) + "]";
    const std::size_t colon = line.find(": ");
    if (!is_in_section || colon == std::string::npos) continue;
    std::istringstream flags(line.substr(0, colon));
    for (std::string flag; flags >> flag;) {
      if (flag == name) return line.substr(colon + 2);
    }
  }
  return {};
}

/// Explains that flags such as "--no-flip-y" do not exist, since flags are off by default.
std::string explain_negated_flag(const Command& command, const std::string& name) {
  if (!name.starts_with("no-")) return {};
  const std::string flag = name.substr(3);
  const Option* option = command.find_option("--" + flag);
  if (option == nullptr) return {};
  if (!option->is_flag()) {
    return "Leave --" + flag + " out to use its default, or give it a value.";
  }
  return "Without --" + flag + " the feature is off, which is the default: leave --no-" + flag +
         " out.";
}

/// Explains that the name of a map or a match is no flag.
std::string explain_map_or_match_name(const std::string& name) {
  const auto answer = [&](const char* what, const char* flag, std::string_view note) {
    return "'" + name + "' is " + what + ": " + flag + " " + std::string(note) + ".";
  };
  const MapInfo* const map = find_map_by_word(name);
  if (map != nullptr) return answer("a map", "--maps", map->kind.name);
  const MatchInfo* const match = find_match_by_word(name);
  if (match != nullptr) return answer("a match", "--match", match->method.name);
  return {};
}

std::string most_similar_flag(const Command& command, const std::string& name) {
  std::vector<std::string> known_flags = {"help"};
  for (const Option* option : command.get_options()) {
    known_flags.insert(known_flags.end(), option->get_lnames().begin(), option->get_lnames().end());
  }
  const std::string nearest = nearest_word(name, known_flags);
  return nearest.empty() ? "" : "--" + nearest;
}

}  // namespace

std::string explain_unknown_flag(const Command& command, const std::string& word) {
  const std::string flag = word.substr(0, word.find('='));
  const std::string name = flag.substr(std::min(flag.find_first_not_of('-'), flag.size()));
  const std::string start = command.get_name() + " has no option '" + flag + "'";
  if (std::string text = explain_negated_flag(command, name); !text.empty()) {
    return start + ". " + text;
  }
  if (command.get_name() == "chart") {
    if (std::string text = find_explanation("chart", name); !text.empty())
      return start + ". " + text;
  }
  if (command.get_name() == "bake") {
    if (std::string text = find_explanation("bake", name); !text.empty())
      return start + ". " + text;
    if (std::string text = explain_map_or_match_name(name); !text.empty())
      return start + ". " + text;
  }
  if (command.find_option("--faces") != nullptr) {
    if (std::string text = find_explanation("faces", name); !text.empty())
      return start + ". " + text;
  }
  const std::string nearest = most_similar_flag(command, name);
  return start + (nearest.empty() ? "." : "; did you mean " + nearest + "?");
}

}  // namespace kiln::cli
