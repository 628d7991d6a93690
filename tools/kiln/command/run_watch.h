// kiln run --watch: a run whenever what it depends on changes.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "report/console.h"

namespace kiln::cli {

/// Runs this program again as it was called, but without --watch, and once more whenever a file changes. Each run is a
/// process of its own: what it reads and writes, and how it ends, is no other's.
/// \param files  that a change of begins a run: called before and after each run
/// \param plan   what a run would make, as a text: another one begins a run, too, such as for a new file
/// \returns the exit code of an interrupt, by which alone it ends
/// \throws Error(internal) where the system does not say how the program was called
int run_watched(const std::function<std::set<std::string>()>& files,
                const std::function<std::string()>& plan, Console& console);

}  // namespace kiln::cli
