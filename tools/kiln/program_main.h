// The main function of a program of commands: parses, runs one of them, turns errors into the documented exit codes.
#pragma once

#include <span>

#include "commands.h"

namespace kiln::cli {

/// \param commands  of the program, in the order of its help
/// \returns the exit code
int program_main(int argc, char** argv, std::span<const CommandEntry> commands);

}  // namespace kiln::cli
