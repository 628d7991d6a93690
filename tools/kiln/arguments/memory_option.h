// --memory-limit: an option of every command.
#pragma once

#include <cstdint>
#include <string>

#include "arguments/command_line.h"

namespace kiln::cli {

/// "500M", "4G", "2T" (binary: 1024 of each make one of the next) or bytes, from 64M up. \throws Error(usage)
std::uint64_t parse_memory(const std::string& text);

/// Adds the option to all commands of the program; it counts as soon as it is read.
void add_memory_option(Command& app);

}  // namespace kiln::cli
