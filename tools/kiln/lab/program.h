// Another program, run to its end.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kiln::cli {

struct ProgramResult {
  int exit_code = 0;   ///< 128 + signal where one ended it
  std::string output;  ///< Standard output, any bytes
  std::string errors;  ///< Standard error
};

/// Runs a program found in PATH, with nothing on its standard input.
/// \param command  name and arguments
/// \param folder  where it starts
/// \param limit_seconds  killed then, as it is at an interrupt
/// \returns nothing where there is no such program
/// \throws Error(internal) where it cannot be started for another reason
std::optional<ProgramResult> run_program(std::vector<std::string> command,
                                         const std::filesystem::path& folder, double limit_seconds);

}  // namespace kiln::cli
