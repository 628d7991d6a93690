#include "program.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "arguments/unknown_flags.h"
#include "kiln/image_format.h"
#include "kiln/limits.h"
#include "kiln/reasons.h"
#include "kiln/version.h"
#include "options/near_words.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {}  // namespace

std::uint64_t parse_memory(const char* flag, const std::string& text) {
  constexpr const char* kUnits = "KMGT";
  double value = 0;
  const char* const end = text.data() + text.size();
  auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc() && rest + 1 == end && std::strchr(kUnits, *rest) != nullptr) {
    value = std::ldexp(value, 10 * static_cast<int>(std::strchr(kUnits, *rest) - kUnits + 1));
    ++rest;
  }
  refuse_if(error != std::errc() || rest != end || !(value >= 0x1p26 && value <= 0x1p60),
            std::string(flag) + ": '" + text +
                "' is not a size: give 64M or more, such as 500M, 4G or 2T.");
  return static_cast<std::uint64_t>(value);
}

namespace {

/// Adds --memory-limit to all commands. The limit takes effect as soon as the flag is parsed.
void add_memory_option(Command& app) {
  for (Command* command : app.commands()) {
    command
        ->add_option(
            "--memory-limit",
            [](const Option::Words& words) {
              set_memory_limit(parse_memory("--memory-limit", words.back()));
            },
            "Largest amount of memory to use, such as 4G (default: three quarters of the free "
            "memory)")
        ->type_name("SIZE")
        ->group("The run");
  }
}

void check_environment() {
  const char* const builder = std::getenv("KILN_BVH_BUILDER");
  if (builder != nullptr && std::string_view(builder) != "host" &&
      std::string_view(builder) != "device") {
    throw UsageError("KILN_BVH_BUILDER is '" + std::string(builder) +
                     "': set it to 'host' or 'device', or unset it");
  }
  const char* threads = std::getenv("KILN_THREADS");
  if (threads == nullptr) return;
  char* end = nullptr;
  const long value = std::strtol(threads, &end, 10);
  if (end == threads || *end != '\0' || value < 1 || value > 1024) {
    throw UsageError("KILN_THREADS is '" + std::string(threads) +
                     "': set it to 1 to 1024, or unset it");
  }
}

std::string join_with_commas(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

Command* add_lab_command_name(Command& app, std::string_view name) {
  const auto* command = std::find_if(kLabCommands.begin(), kLabCommands.end(),
                                     [&](const auto& known) { return known[0] == name; });
  return app.add_command(name, (*command)[1]);
}

Program::Program(std::span<const CommandEntry> commands)
    : app_("Kiln bakes the detail of high polys into the textures of low polys.", "kiln",
           std::string("kiln ") + version() + "\nPictures: " + join_with_commas(picture_formats()) +
               "\nMeshes: " + join_with_commas(mesh_formats()),
           "Exit codes: 0 done, 1 beyond the limits (diff) or a defect, 2 usage, 3 input, 4 "
           "device,\n"
           "5 output, 130 cancelled. 'kiln COMMAND --help' explains a command.") {
  for (const CommandEntry& entry : commands) {
    Run& run = commands_[std::string(entry.name)];
    if (entry.add != nullptr) {
      run = entry.add(app_);
      continue;
    }
    add_lab_command_name(app_, entry.name);
    // main() has passed such a command to kiln-lab already; see requested_lab_command().
    run = []() -> int { throw std::logic_error("kiln-lab runs this command"); };
  }
  add_memory_option(app_);
}

Run Program::parse(std::vector<std::string> words) {
  // `kiln help COMMAND` works as in git.
  if (!words.empty() && words[0] == "help") {
    words.erase(words.begin());
    if (words.size() > 1) words.resize(1);
    words.push_back("--help");
  }
  if (words == std::vector<std::string>{"version"}) words[0] = "--version";
  // CLI11 would only report that a command is missing, so unknown commands are reported here.
  if (words.empty() || (!words[0].starts_with('-') && commands_.count(words[0]) == 0)) {
    std::vector<std::string> known_commands;
    for (const auto& [name, run] : commands_) known_commands.push_back(name);
    if (words.empty()) {
      throw UsageError("give a command, such as kiln bake HIGH LOW --out DIR; there are " +
                       join_with_commas(known_commands));
    }
    const std::string nearest = nearest_word(words[0], known_commands);
    throw UsageError("there is no command '" + words[0] + "'" +
                     (nearest.empty() ? "; there are " + join_with_commas(known_commands)
                                      : "; did you mean kiln " + nearest + "?"));
  }
  if (!app_.parse(std::move(words))) return {};
  check_environment();
  return commands_.at(app_.given_command()->get_name());
}

std::string Program::explain(const UsageError& error) const {
  const Command* const chosen = app_.given_command();
  const std::vector<std::string> words = app_.unaccepted_words();
  if (const auto mark = std::find(words.begin(), words.end(), "--");
      mark != words.end() && mark + 1 != words.end()) {
    return "'" + *(mark + 1) +
           "' is one word too many: all words after '--' are files. Put options before it";
  }
  for (const std::string& word : words) {
    if (!word.starts_with("-")) continue;
    return explain_unknown_flag(chosen == nullptr ? app_ : *chosen, word);
  }
  if (!words.empty() && chosen != nullptr) {
    const std::string start = "'" + words.front() + "' is one word too many. ";
    const Option* const out = chosen->find_option("--out");
    return start +
           (out != nullptr && out->count() == 0
                ? "The flag for the output is --out"
                : "Separate the items of a list by commas without blanks, such as normal,ao");
  }
  return error.what();
}

}  // namespace kiln::cli
