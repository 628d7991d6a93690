// Functions of this process and of the programs that it starts. Implemented in posix/ and windows/.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace kiln::os {

/// Converts the arguments of the command line to UTF-8 from the system's encoding. Must be called at the start of
/// main() with its parameters, which it may replace.
void read_arguments(int& argc, char**& argv);

/// The command line's arguments of this process; empty if the system does not provide them.
std::vector<std::string> own_arguments();
/// A path at which this program's file can be read while it runs; empty if the system does not provide it.
std::filesystem::path own_program();
/// Writes the folder of this program, with a separator at its end; an empty string if the system does not provide it
/// or `to` is too small. Does not allocate.
void own_folder(std::span<char> to) noexcept;

/// All programs of this name in the folders of PATH, in its order; empty if RunningProgram is not supported.
/// \param unset the folders to search if PATH is not set
std::vector<std::filesystem::path> programs_of_path(const std::string& name,
                                                    const std::string& unset = "");

/// Replaces this process by another program with these arguments (execv()). Does not allocate. \returns errno on
/// failure; ENOSYS if the system does not support it
int become_program(const char* program, char** argv) noexcept;

/// Runs the current executable as a child process, and waits until it ends. \param words  its argv, beginning with the
/// program's name \param interrupted  polled; when it returns true, the child is interrupted, too
/// \returns false if no process can be started
bool run_own_program(const std::vector<std::string>& words,
                     const std::function<bool()>& interrupted);

/// Loads a shared library, which is never unloaded. \returns null on failure, with the reason
void* load_library(const std::string& path, std::string& reason);
/// Finds a function in a library of load_library(); null if the library has no function of this name.
void* find_library_function(void* library, const char* name) noexcept;

/// True if the system supports prepare_restart() and split_process().
bool can_restart() noexcept;

/// Allocates all memory that restart() needs.
/// \param argv of main(); must stay valid \param variable "NAME=VALUE" of at most 63 bytes, added to the
/// environment
void prepare_restart(char** argv, const std::string& variable);
/// Restarts the program with the same arguments. Async-signal-safe. Returns only if that is impossible.
void restart() noexcept;

/// Tells whether split_process() has returned in the parent process or in the child.
struct SplitEnd {
  enum class Kind {
    child,   ///< The child process, which continues the work
    parent,  ///< The parent process, after the child has ended
    failed,  ///< No process could be created
  } kind = Kind::failed;
  int exit_code = 0;  ///< Exit code of the forked process; 128 + signal if a signal ended it
};
/// Forks this process. The parent waits until the child ends, and forwards requests to end to it.
SplitEnd split_process();

}  // namespace kiln::os
