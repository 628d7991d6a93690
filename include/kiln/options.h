/// \file
/// The options of a Job as text and JSON: for programs that take settings from their users, scripts and files.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"
#include "kiln/job.h"

namespace KILN_PUBLIC kiln {

/// Sets an option of a job from text, as the flag of that name does: `set_option(job, "max_distance", "2%")`. What was
/// there before is replaced.
/// \param name   as the flag ("max-distance", "max_distance", "--max-distance"), or as the member it sets
///               ("match.max_distance", "bake.match.max_distance")
/// \param value  as the flag takes it; of lists, several with commas between them where the flag takes them so; of a
///               flag without a value "true" or "false"
/// \throws Error(usage) for a name that no option has; OptionError (kiln/option_error.h) for what is no value of it: with the
///         range, or the choices
/// Thread safety: may be called from several threads, on jobs of their own.
void set_option(Job& job, std::string_view name, std::string_view value);
/// The same with several values, as a flag that is given several times.
void set_option(Job& job, std::string_view name, const std::vector<std::string>& values);

/// The values of an option, as set_option() takes them; empty: none. \throws Error(usage) for a name that no option has
std::vector<std::string> option_values(const Job& job, std::string_view name);

/// True if an option was set, or has another value than in a job that was told nothing.
/// \throws Error(usage) for a name that no option has
bool is_given(const Job& job, std::string_view name);

/// A job as JSON: an object with "high", "low" (a path, or a list of them), "out", and each option that is not at its
/// default or stands in Job::given, by its flag's name with underscores. Values are as set_option() takes them, numbers and
/// truth values as such. \throws Error(usage) where a mesh is in memory, and so has no name to be read by
std::string to_json(const Job& job);
/// Sets all options that a JSON object names; others stay. Of lists of numbers, [0, 0, 1] is one value, such as a
/// direction, or a size. \throws Error(usage) as job_from_json()
void set_options(Job& job, std::string_view json);
/// The job that a JSON describes: to_json() of it is the same again. Objects stand for lists of NAME=VALUE.
/// \throws Error(usage) for what is no JSON object, or nested too deep, and for keys and values as set_option()
Job job_from_json(std::string_view json);

/// All options as JSON, a list: name, flag, member, type, unit, range, choices, default, what matches and maps they
/// serve, and help. As `kiln bake --help-json`.
std::string options_json();
/// A JSON Schema (2020-12) of what job_from_json() takes.
std::string job_schema();

}  // namespace kiln
