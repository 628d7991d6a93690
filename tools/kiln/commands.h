// The subcommands. Each adds itself to the command line and says what to run.
#pragma once

#include <functional>

#include "arguments/command_line.h"

namespace kiln::cli {

/// Runs a parsed subcommand; returns the exit code.
using Run = std::function<int()>;

Run add_bake(Command& app);
Run add_simplify(Command& app);
Run add_render(Command& app);
Run add_measure(Command& app);
Run add_chart(Command& app);
Run add_gallery(Command& app);
Run add_diff(Command& app);
Run add_volume(Command& app);
Run add_devices(Command& app);

}  // namespace kiln::cli
