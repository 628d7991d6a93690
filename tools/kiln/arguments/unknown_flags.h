// Explains unknown flags.
#pragma once

#include <string>

#include "arguments/command_line.h"

namespace kiln::cli {

/// Explains in full sentences a word that begins with "-" but is no flag of the command.
std::string explain_unknown_flag(const Command& command, const std::string& word);

}  // namespace kiln::cli
