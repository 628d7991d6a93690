// Running a program and looking at what it did.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace kiln::test {

struct ProcessOptions {
  std::map<std::string, std::string> environment;  ///< Added to ours
  /// `signal` is sent after so many processor seconds of the program: by the clock it has come less far on a
  /// busy machine. Below 0: never.
  double interrupt_after_processor_seconds = -1;
  /// Or as soon as this says so.
  std::function<bool()> interrupt_when;
  int signal = 2;
  std::uint64_t file_size_limit = 0;  ///< Bytes (RLIMIT_FSIZE), 0: none
  double timeout_seconds = 600;       ///< Killed then
};

struct ProcessResult {
  int exit_code = -1;  ///< 128 + signal where a signal ended it
  std::string output;  ///< Standard output
  std::string errors;  ///< Standard error
  double seconds = 0;
  std::uint64_t peak_bytes = 0;      ///< The most that it held in memory at once
  double seconds_after_signal = -1;  ///< Below 0 where it ended before
};

ProcessResult run_process(const std::vector<std::string>& command,
                          const ProcessOptions& options = {});

/// The kiln command of this build. \param arguments after the command's name
ProcessResult run_kiln(std::vector<std::string> arguments, const ProcessOptions& options = {});

/// True if standard error has warnings alone, or nothing.
bool only_warnings(const std::string& errors);

/// A folder to take as PATH: every program on ours but `program`. (An empty PATH would also take away
/// the linker, which PoCL calls where a kernel isn't in its cache.)
std::string path_without(const std::string& program);

/// No Python, so no pictures of data: drawing one takes it a second.
ProcessOptions without_python();

/// Path of the program that PATH finds first; empty if there is none.
std::string found_program(const std::string& name);

/// A folder with one program, NAME: a script for /bin/sh.
std::string folder_with(const std::string& name, const std::string& script);

/// True if a python3 of PATH has matplotlib, so that pictures of data are drawn.
bool has_matplotlib();

}  // namespace kiln::test
