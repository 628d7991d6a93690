// This process and the programs that it starts. Implemented in posix/ and windows/.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace kiln::os {

/// The words of the command line as UTF-8, whatever the system's own encoding. To be called at the start of main() with
/// its parameters, which it may replace.
void read_arguments(int& argc, char**& argv);

/// The words that this process was called by; empty: the system does not say.
std::vector<std::string> own_words();
/// A path that this program's file can be read by, as long as it runs; empty: the system does not say.
std::filesystem::path own_program();
/// The folder of this program, with a separator at its end; empty: the system does not say, or `to` is too small. Takes no
/// memory.
void own_folder(std::span<char> to) noexcept;

/// All programs of this name that PATH has, in its order; none where RunningProgram starts none.
/// \param unset  the folders where PATH is not set
std::vector<std::filesystem::path> programs_of_path(const std::string& name,
                                                    const std::string& unset = "");

/// Becomes another program, with these arguments. Takes no memory. \returns errno where it cannot; ENOSYS where no process
/// can become another
int become_program(const char* program, char** argv) noexcept;

/// Runs this program with these words, and waits for its end. \param interrupted  polled; an interrupt is passed on
/// \returns false where no process can be started
bool run_own_program(const std::vector<std::string>& words,
                     const std::function<bool()>& interrupted);

/// Loads a shared library for good. \returns null where it cannot, with the reason
void* load_library(const std::string& path, std::string& reason);
/// A function of a library that load_library() gave; null: it has none of this name.
void* function_of(void* library, const char* name) noexcept;

/// True if prepare_restart() and split_process() can work on this system.
bool can_restart() noexcept;

/// Allocates all that restart() needs.
/// \param argv  of main(), kept  \param variable  "NAME=VALUE" of at most 63 bytes, added to the environment
void prepare_restart(char** argv, const std::string& variable);
/// Begins the program anew, with the same words. Async-signal-safe. Returns where that is impossible.
void restart() noexcept;

/// One of the two processes that split_process() makes of one.
struct SplitEnd {
  enum class Kind {
    copy,    ///< The new process, which goes on with the work
    waited,  ///< The old one, when the copy has ended
    failed,  ///< No process could be made
  } kind = Kind::failed;
  int exit_code = 0;  ///< Of the copy: 128 + signal where one ended it
};
/// Makes a copy of this process, and waits for its end. Requests to end are passed on to the copy.
SplitEnd split_process();

}  // namespace kiln::os
