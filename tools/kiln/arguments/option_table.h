// What each flag of the bake command serves.
#pragma once

#include <set>
#include <string>

#include "arguments/bake_arguments.h"
#include "arguments/command_line.h"

namespace kiln::cli {

/// The flags that were given, at their default value or another, such as "--views".
std::set<std::string> given_flags(const Command& command);

/// Refuses flags that were given but serve none of the matches or maps asked for. \throws Error(usage)
void check_served(const BakeArguments& arguments);

}  // namespace kiln::cli
