// Flags of other bakers that Kiln has not, and what to do instead.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace kiln::cli {

/// What to say of a word that begins with "-" and is no flag of this command: whole sentences.
std::string answer_to_unknown(const CLI::App& command, const std::string& word);

}  // namespace kiln::cli
