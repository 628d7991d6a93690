// Runs work that may crash or exhaust memory in a child process.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace kiln {

enum class ChildEnd {
  not_run,  ///< The work did not run: no child could be created, or the system does not support child processes
  finished,   ///< The child ended normally
  timed_out,  ///< The child exceeded its time limit
  crashed,    ///< The child ended by a signal or std::terminate()
};

struct ChildLimits {
  std::uint64_t seconds = 0;  ///< Limit of processor time; the wall-clock limit is ten times that
  /// Limit of the child's address space, in addition to what this process uses when it forks
  std::uint64_t bytes = 0;
};

/// Forks, calls `work` in the child within limits, and waits until the child ends. Only the returned text is passed
/// back; an exception becomes the text "it takes too much memory". Polls progress while waiting, which may throw.
ChildEnd run_in_child(const ChildLimits& limits, const std::function<std::string()>& work,
                      std::string& returned);

}  // namespace kiln
