// A program that works beside this one.
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
  int exit_code = 0;   ///< 128 + signal where one ended it
  std::string output;  ///< Standard output, any bytes
  std::string errors;  ///< Standard error
};

/// A program that works beside this one, until it is given its standard input. It is killed with this object.
class RunningProgram {
 public:
  /// False where the system starts none (Windows).
  static bool supported() noexcept;
  /// \param command  name and arguments; the name is looked for in PATH
  /// \param folder  where it starts
  /// \returns nothing where there is no such program, or where none is supported
  /// \throws Error(internal) where it cannot be started for another reason
  static std::optional<RunningProgram> start(std::vector<std::string> command,
                                             const std::filesystem::path& folder);
  RunningProgram(RunningProgram&&) noexcept;
  RunningProgram& operator=(RunningProgram&&) noexcept;
  ~RunningProgram();

  /// Gives it all of its standard input, and returns while it works on. To be called once.
  /// \param input  what it does not read is left
  /// \param limit_seconds  from now on; it is killed then
  /// \param interrupted  polled on another thread; the program is killed once it is true
  void begin(std::string input, double limit_seconds, std::function<bool()> interrupted);
  /// True if begin() was called, and with this.
  bool began() const;
  bool began_with(std::string_view input) const;

  /// After begin(): waits for its end. To be called once.
  ProgramResult finish();

 private:
  struct Process;
  explicit RunningProgram(std::unique_ptr<Process> process);
  std::unique_ptr<Process> process_;
};

}  // namespace kiln
