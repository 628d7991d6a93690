// Runs programs and captures what they did.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace kiln::test {

struct ProcessOptions {
  /// Variables that are added to this process's environment
  std::map<std::string, std::string> environment;
  /// Sends `signal` after this many processor seconds of the program; wall-clock time would depend on the machine's
  /// load. Below 0: never.
  double interrupt_after_processor_seconds = -1;
  /// Sends `signal` as soon as this function returns true
  std::function<bool()> interrupt_when;
  int signal = 2;
  /// Largest size in bytes of a written file (RLIMIT_FSIZE); 0: no limit
  std::uint64_t file_size_limit = 0;
  double timeout_seconds = 600;  ///< Time after which the program is killed
};

struct ProcessResult {
  int exit_code = -1;  ///< Exit code; 128 + signal if a signal ended the program
  std::string output;  ///< Contents of standard output
  std::string errors;  ///< Contents of standard error
  double seconds = 0;
  std::uint64_t peak_bytes = 0;  ///< Peak resident memory in bytes
  /// Seconds from the signal to the end; below 0 if the program ended before
  double seconds_after_signal = -1;
};

ProcessResult run_process(const std::vector<std::string>& command,
                          const ProcessOptions& options = {});

/// Runs the kiln command of this build. \param arguments  arguments after the command's name
ProcessResult run_kiln(std::vector<std::string> arguments, const ProcessOptions& options = {});

/// True if standard error contains only warnings, or nothing.
bool only_warnings(const std::string& errors);

/// Creates a folder to be used as PATH, with all programs of this process's PATH except `program`. An empty PATH would
/// also hide the linker, which PoCL calls for kernels that are not cached.
std::string path_without(const std::string& program);

/// Options for a run without Python, so that no plots are drawn, which takes a second each.
ProcessOptions without_python();

/// Path of the first program with this name in PATH; empty if there is none.
std::string found_program(const std::string& name);

/// Creates a folder with one program, NAME, which is a script for /bin/sh.
std::string folder_with(const std::string& name, const std::string& script);

/// True if a python3 in PATH has matplotlib, so that plots are drawn.
bool has_matplotlib();

}  // namespace kiln::test
