// A child program that runs in parallel with this one.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

struct ProgramResult {
  int exit_code = 0;   ///< Exit status; 128 + signal if a signal ended the program
  std::string output;  ///< Standard output, any bytes: the first 64 MiB
  std::string errors;  ///< Standard error: the first 64 MiB
};

/// A child program that is started early, so that it can initialise while this program prepares its standard
/// input. The destructor kills it.
class RunningProgram {
 public:
  /// False if the system is not supported (Windows).
  static bool is_supported() noexcept;
  /// \param command name and arguments; the name is searched in PATH
  /// \param folder its working folder
  /// \returns nullopt if there is no such program, or if the system is not supported
  /// \throws Error(internal) if it cannot be started for another reason
  static std::optional<RunningProgram> start(std::vector<std::string> command,
                                             const std::filesystem::path& folder);
  RunningProgram(RunningProgram&&) noexcept;
  RunningProgram& operator=(RunningProgram&&) noexcept;
  ~RunningProgram();

  /// Starts to write to the program's standard input, and returns while the program runs. Must be called once.
  /// \param input bytes for the program's standard input; the program need not read all of them
  /// \param limit_seconds time limit from this call on, after which the program is killed
  /// \param interrupted polled on another thread; the program is killed when it returns true
  void begin(std::string input, double limit_seconds, std::function<bool()> interrupted);
  /// True if begin() was called. has_begun_with_input() is true if begin() was called with this
  /// input.
  bool has_begun() const;
  bool has_begun_with_input(std::string_view input) const;

  /// Waits until the program ends. Must be called once, after begin().
  ProgramResult finish();

 private:
  struct Process;
  explicit RunningProgram(std::unique_ptr<Process> process);
  std::unique_ptr<Process> process_;
};

}  // namespace kiln
