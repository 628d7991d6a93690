#include "arguments/command_options.h"

#include <utility>
#include <vector>

namespace kiln::cli {

void add_options(Command& command, std::span<const OptionRow> rows, void* job) {
  std::vector<std::pair<std::string, Option*>> added;
  for (const OptionRow& row : rows) {
    const OptionValue& value = row.value;
    const Option::ValueCallback take = [set = value.set, flag = row.flag,
                                        job](const OptionWords& words) { set(job, flag, words); };
    const bool is_flag = value.type.starts_with("flag");
    Option* const option =
        is_flag ? command.add_flag(row.flag, take, row.help)
                : command.add_option(row.flag, Option::ValueCallback(take), row.help);
    option->type_name(value.words);
    if (!row.group.empty()) option->group(row.group);
    option->choices(value.choices);
    if (value.repeats) option->repeats();
    if (value.delimiter != 0) option->delimiter(value.delimiter);
    if (row.required) option->required();
    if (!is_flag) option->default_text(format_as_word(value.get(job)));
    for (const auto& [flag, other] : added) {
      if ((" " + row.excludes + " ").find(" " + flag + " ") != std::string::npos) {
        option->excludes(other);
      }
      if (flag == row.needs) option->needs(other);
    }
    added.emplace_back(row.flag, option);
  }
}

std::set<std::string> given_flags(const Command& command) {
  std::set<std::string> given_names;
  for (const Option* option : command.get_options()) {
    if (option->count() == 0) continue;
    for (const std::string& name : option->get_lnames()) given_names.insert("--" + name);
  }
  return given_names;
}

namespace {

std::set<std::string> flags_of(const std::vector<OptionRow>& rows) {
  std::set<std::string> flags;
  for (const OptionRow& row : rows) flags.insert(row.flag);
  return flags;
}

}  // namespace

std::set<std::string> add_matching_flags(Command& command, Job& job,
                                         const std::set<std::string>& without) {
  // Flags of mesh input that affect the match
  static const std::set<std::string> mesh_input_flags = {
      "--high",          "--low",         "--triangulate",    "--tangents",
      "--uv-copies",     "--two-sided",   "--split-at-seams", "--traversal",
      "--load-match",    "--up",          "--unit",           "--uv-set",
      "--allow-outside", "--high-normals"};
  static const std::set<std::string> excluded_flags = {
      "--visibility-clusters", "--visibility-deviation", "--save-cage", "--reasons", "--recall"};
  const std::vector<OptionRow> rows =
      select_rows(bake_rows(), "The match, as in kiln bake", [&](const OptionRow& row) {
        return (row.is_match_option() || mesh_input_flags.contains(row.flag)) &&
               !excluded_flags.contains(row.flag) && !without.contains(row.flag);
      });
  add_options(command, rows, &job);
  return flags_of(rows);
}

std::set<std::string> add_measured_map_flags(Command& command, Job& job) {
  static const std::set<std::string> map_flags = {"--maps", "--transfer", "--range"};
  // Flags that only affect how files store values, which are left out
  static const std::set<std::string> excluded_flags = {"--space", "--bitangent",     "--flip-y",
                                                       "--raw",   "--two-component", "--gutter",
                                                       "--mips",  "--id-by"};
  const std::vector<OptionRow> rows = select_rows(
      bake_rows(), "Maps whose errors are measured, as in kiln bake", [&](const OptionRow& row) {
        return (row.is_map_option() || map_flags.contains(row.flag)) &&
               !excluded_flags.contains(row.flag);
      });
  add_options(command, rows, &job);
  return flags_of(rows);
}

}  // namespace kiln::cli
