// The command within a test's own process: a start of its program costs more than most of what tests ask of it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "support/process.h"

namespace kiln::test {

/// What run_kiln() does, without a program: no handlers, no limits of the system, and one driver for all calls.
/// \param arguments    after the command's name
/// \param environment  added to ours meanwhile, where the driver does not read it
/// \returns exit code, output and errors
ProcessResult call_kiln(std::vector<std::string> arguments,
                        const std::map<std::string, std::string>& environment = {});

}  // namespace kiln::test
