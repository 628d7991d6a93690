// A program with commands: parsing of its command line, and the main function.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "arguments/command_line.h"
#include "commands.h"

namespace kiln::cli {

/// Parses "500M", "4G", "2T" (powers of 1024) or bytes, at least 64M. \throws Error(usage)
std::uint64_t parse_memory(const char* flag, const std::string& text);

class Program {
 public:
  /// \param commands  in the order of help
  explicit Program(std::span<const CommandEntry> commands);

  /// Parses the words after the program's name to a function to run; empty after --help and --version, which are
  /// answered here.
  /// \throws UsageError
  Run parse(std::vector<std::string> words);

  /// The error in full sentences, with alternatives to an unknown option.
  std::string explain(const UsageError& error) const;

  /// All commands.
  const Command& app() const { return app_; }

 private:
  Command app_;
  std::map<std::string, Run> commands_;
};

/// Parses the command line, runs the command, and converts errors to the documented exit codes. Installs no signal
/// handlers, and sets no limits but --memory-limit.
/// \param commands  the program's commands in the order of help
/// \returns the exit code
int run_program(int argc, char** argv, std::span<const CommandEntry> commands);

/// The main function: run_program() with handlers for signals and crashes; after a driver's crash, the run is repeated
/// under supervision.
int program_main(int argc, char** argv, std::span<const CommandEntry> commands);

}  // namespace kiln::cli
