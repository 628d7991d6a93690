// A program of commands: what a command line asks for, and the main function.
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

/// "500M", "4G", "2T" (binary: 1024 of each make one of the next) or bytes, from 64M up. \throws Error(usage)
std::uint64_t parse_memory(const char* flag, const std::string& text);

class Program {
 public:
  /// \param commands  in the order of help
  explicit Program(std::span<const CommandEntry> commands);

  /// The run that the words after the program's name ask for; none where it is answered already (--help, --version).
  /// \throws UsageError
  Run parse(std::vector<std::string> words);

  /// The error, with what to do instead where an option is unknown: whole sentences.
  std::string explain(const UsageError& error) const;

  /// All commands.
  const Command& app() const { return app_; }

 private:
  Command app_;
  std::map<std::string, Run> commands_;
};

/// Parses, runs one of the commands, and turns errors into the documented exit codes. Sets no handlers and, but for
/// --memory-limit, no limits.
/// \param commands  of the program, in the order of its help
/// \returns the exit code
int run_program(int argc, char** argv, std::span<const CommandEntry> commands);

/// The main function: run_program(), with handlers of signals and of crashes, and supervised where a driver failed.
int program_main(int argc, char** argv, std::span<const CommandEntry> commands);

}  // namespace kiln::cli
