// Answers to flags that no command has.
#pragma once

#include <string>

#include "arguments/command_line.h"

namespace kiln::cli {

/// The answer for a word that begins with "-" and is no flag of this command: whole sentences.
std::string answer_to_unknown(const Command& command, const std::string& word);

}  // namespace kiln::cli
