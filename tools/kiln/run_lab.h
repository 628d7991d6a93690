// The commands that another program runs.
#pragma once

#include "commands.h"

namespace kiln::cli {

/// The command of the lab that the words ask for, or for whose help; nullptr: none.
const char* asked_of_lab(int argc, char** argv);

/// Becomes kiln-lab, with the same words: it stands beside this program, or where both are installed.
/// \param command  for the message
/// \returns the exit code where it cannot be run, which a message explains
int run_lab(const char* command, char** argv);

}  // namespace kiln::cli
