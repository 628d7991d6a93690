// Work that may crash or take all there is, in a child of this process.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace kiln {

enum class ChildEnd {
  none,     ///< No child could be made, or the system has none: nothing was run
  done,     ///< It ended by itself
  slow,     ///< It took more seconds than it may
  crashed,  ///< A signal or std::terminate() ended it
};

struct ChildLimits {
  std::uint64_t seconds =
      0;  ///< Limit of processor time; one that waits is ended after ten times that
  std::uint64_t bytes = 0;  ///< Limit of address space, beyond what this process has
};

/// Forks, calls `work` in the child within limits, and waits for its end. Nothing of what it changes comes back but
/// the text that it returns; of what it throws, "it takes too much memory". Polls progress meanwhile, which may throw.
ChildEnd run_in_child(const ChildLimits& limits, const std::function<std::string()>& work,
                      std::string& returned);

}  // namespace kiln
