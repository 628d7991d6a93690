// Adds rows of the option table to commands.
#pragma once

#include <set>
#include <span>
#include <string>

#include "arguments/command_line.h"
#include "job/job_options.h"
#include "options/option_table.h"

namespace kiln::cli {

/// Adds the options that rows of an option table describe to a command.
/// \param job  object whose members the rows set; must outlive parsing
void add_options(Command& command, std::span<const OptionRow> rows, void* job);

/// Flags that were given on the command line, such as "--views", even if the value is the default.
std::set<std::string> given_flags(const Command& command);

/// Adds --device, --json and --quiet.
template <typename Job>
void add_run_options(Command& command, Job& job, const char* group = "") {
  const OptionRow rows[] = {device_row<Job>(group), json_row<Job>(group), quiet_row<Job>(group)};
  add_options(command, rows, &job);
}
/// Adds --height, --extent and --no-data to a command. \param job  must have a member `heights`
template <typename Job>
void add_height_options(Command& command, Job& job, const char* group) {
  const OptionRow rows[] = {height_row<Job>(group), extent_row<Job>(group),
                            no_data_row<Job>(group)};
  add_options(command, rows, &job);
}

/// Adds the flags of `kiln bake` that affect which points are found, except those that the command omits or defines
/// itself. Call this before the command adds its own.
/// \param without  flags to omit, such as "--match"
/// \returns the names of the added flags
std::set<std::string> add_matching_flags(Command& command, Job& arguments,
                                         const std::set<std::string>& without);

/// Adds the flags of `kiln bake` that select maps and define their values: --maps, --transfer, and those of occlusion,
/// shadow and curvature.
/// \returns the names of the added flags
std::set<std::string> add_measured_map_flags(Command& command, Job& arguments);

}  // namespace kiln::cli
