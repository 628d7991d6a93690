// `kiln run --watch`: repeats a run whenever one of its dependencies changes.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "report/console.h"

namespace kiln::cli {

/// Runs this program with the same arguments except --watch, and again whenever a file changes. Each run is a separate
/// process, so that crashes and state do not affect later ones.
/// \param files  returns the files whose changes start a run; called before and after each run
/// \param plan  returns a text that describes the outputs of a run; a different text also starts a run, for example
/// after a new input file
/// \returns the exit code of an interrupt, which is the only way to end it
/// \throws Error(internal) if the system does not provide the program's arguments
int run_watched(const std::function<std::set<std::string>()>& files,
                const std::function<std::string()>& plan, Console& console);

}  // namespace kiln::cli
