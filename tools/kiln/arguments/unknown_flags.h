// Explanations for unknown flags.
#pragma once

#include <string>

#include "arguments/command_line.h"

namespace kiln::cli {

/// Explains a word that begins with "-" and is no flag of this command, in full sentences.
std::string answer_to_unknown(const Command& command, const std::string& word);

}  // namespace kiln::cli
