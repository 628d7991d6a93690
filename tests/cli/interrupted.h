// A command that is interrupted: it ends soon, and leaves nothing.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "support/environment.h"
#include "support/process.h"

namespace kiln::test {

/// Runs a command with `--out` and a folder of its own, and interrupts it.
/// \param after  processor seconds until the signal
/// \param most   seconds until it ends then, on a machine that does nothing else; so the quickest of several
///               tries counts, each of which must leave nothing
inline void expect_interrupt_leaves_nothing(const std::vector<std::string>& arguments, double after,
                                            double most) {
  double least = 1e9;
  for (int tries = 0; tries < 4 && least >= most; ++tries) {
    const std::filesystem::path out = scratch_folder() / "out";
    std::vector<std::string> words = arguments;
    words.insert(words.end(), {"--out", out});
    ProcessOptions options;
    options.interrupt_after_processor_seconds = after;
    const ProcessResult result = run_kiln(words, options);
    EXPECT_EQ(result.exit_code, 130) << "after " << after << " s: " << result.errors;
    EXPECT_FALSE(std::filesystem::exists(out)) << "after " << after << " s";
    ASSERT_GE(result.seconds_after_signal, 0) << "it ended within " << after << " s";
    least = std::min(least, result.seconds_after_signal);
  }
  EXPECT_LT(least, most) << "after " << after << " s";
}

}  // namespace kiln::test
