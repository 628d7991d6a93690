// A program with commands: its command line, and its main function.
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

/// Parses an amount of memory: "500M", "4G", "2T" (powers of 1024) or bytes, at least 64M. \throws Error(usage)
std::uint64_t parse_memory(const char* flag, const std::string& text);

class Program {
 public:
  /// Creates the program. \param commands  its commands, in the order of help
  explicit Program(std::span<const CommandEntry> commands);

  /// Parses the words after the program's name to a function to run; empty after --help and --version, which are
  /// handled here. \throws UsageError
  Run parse(std::vector<std::string> words);

  /// Explains a syntax error in full sentences, with alternatives to an unknown option.
  std::string explain(const UsageError& error) const;

  /// The command line with all commands.
  const Command& app() const { return app_; }

 private:
  Command app_;
  std::map<std::string, Run> commands_;
};

/// Parses the command line, runs the command, and converts errors to the documented exit codes. It installs no signal
/// handlers, and sets no limits except --memory-limit.
/// \param commands  the program's commands, in the order of help
/// \returns the exit code
int run_program(int argc, char** argv, std::span<const CommandEntry> commands);

/// The main function: run_program() with handlers for signals and crashes. After a driver's crash, the run is repeated;
/// see crash.h.
int program_main(int argc, char** argv, std::span<const CommandEntry> commands);

}  // namespace kiln::cli
