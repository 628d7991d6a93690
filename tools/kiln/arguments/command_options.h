// Rows of the option table as options of commands.
#pragma once

#include <set>
#include <span>
#include <string>

#include "arguments/command_line.h"
#include "job/job_options.h"
#include "options/option_table.h"

namespace kiln::cli {

/// Adds the options of rows to a command. \param job  of the type that the rows are of; outlives the parsing
void add_options(Command& command, std::span<const OptionRow> rows, void* job);

/// The flags that were given, at their default value or another, such as "--views".
std::set<std::string> given_flags(const Command& command);

/// Adds --device, --json and --quiet.
template <typename Job>
void add_run_options(Command& command, Job& job, const char* group = "") {
  const OptionRow rows[] = {device_row<Job>(group), json_row<Job>(group), quiet_row<Job>(group)};
  add_options(command, rows, &job);
}
/// Adds --height, --extent and --no-data to a command. \param job  with a member `heights`
template <typename Job>
void add_height_options(Command& command, Job& job, const char* group) {
  const OptionRow rows[] = {height_row<Job>(group), extent_row<Job>(group),
                            no_data_row<Job>(group)};
  add_options(command, rows, &job);
}

/// Adds all flags of the bake that change which points are found. A command may have none of some, or its own.
/// \param without  names such as "--match"; call this before the command adds its own
/// \returns the names of those added
std::set<std::string> add_matching_flags(Command& command, Job& arguments,
                                         const std::set<std::string>& without);

/// Adds the flags of the bake that say which maps are made and what they hold: --maps, --transfer, those of
/// occlusion, shadow and curvature. \returns their names
std::set<std::string> add_measured_map_flags(Command& command, Job& arguments);

}  // namespace kiln::cli
