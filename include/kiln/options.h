/// \file
/// The options of a Job as text and JSON: for programs that read settings from users, scripts and files.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"
#include "kiln/job.h"

namespace KILN_PUBLIC kiln {

/// Sets an option of a job from text, like the command's flag of that name: `set_option(job, "max_distance", "2%")`.
/// The previous value is replaced.
/// \param name   name of the flag ("max-distance", "max_distance", "--max-distance"), or of the member that it sets
///               ("match.max_distance", "bake.match.max_distance")
/// \param value  value as the flag accepts it. For a list, several values separated by commas if the flag accepts
///               that; for a flag without a value, "true" or "false"
/// \throws Error(usage) for an unknown name; OptionError (kiln/option_error.h) for an invalid value, with the range or
///         the choices
/// Thread safety: may be called from several threads, for different jobs.
void set_option(Job& job, std::string_view name, std::string_view value);
/// Sets an option from several values, like a flag that is given several times.
void set_option(Job& job, std::string_view name, const std::vector<std::string>& values);

/// The values of an option, in the form that set_option() accepts; empty: it has none. \throws Error(usage)
/// for an unknown name
std::vector<std::string> option_values(const Job& job, std::string_view name);

/// True if an option was set, or differs from its default.
/// \throws Error(usage) for an unknown name
bool is_given(const Job& job, std::string_view name);

/// A job as JSON: an object with "high", "low" (a path, or a list of paths), "out", and each option that differs from
/// its default or is listed in Job::given. Keys are names of flags with underscores. Values have the form that
/// set_option() accepts, or are JSON numbers and booleans. \throws Error(usage) if a mesh is in memory, so that it
/// has no path
std::string to_json(const Job& job);
/// Sets all options that a JSON object names; others are kept. In lists of numbers, [0, 0, 1] is one value, such
/// as a direction or a size. \throws Error(usage) as job_from_json()
void set_options(Job& job, std::string_view json);
/// The job described by JSON; to_json() of the result gives equivalent JSON. Objects may replace lists of
/// NAME=VALUE.
/// \throws Error(usage) for invalid JSON, too deep nesting, and invalid keys and values as in set_option()
Job job_from_json(std::string_view json);

/// All options as a JSON list: name, flag, member, type, unit, range, choices, default, the matches and maps that
/// they affect, and help; the output of `kiln bake --help-json`.
std::string options_json();
/// A JSON Schema (2020-12) of the input of job_from_json().
std::string job_schema();

}  // namespace kiln
