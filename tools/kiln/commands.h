// The subcommands. Each adds itself to the command line and says what to run.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace kiln::cli {

/// Runs a parsed subcommand; returns the exit code.
using Run = std::function<int()>;

Run add_bake(CLI::App& app);
Run add_simplify(CLI::App& app);
Run add_render(CLI::App& app);
Run add_measure(CLI::App& app);
Run add_chart(CLI::App& app);
Run add_gallery(CLI::App& app);
Run add_diff(CLI::App& app);
Run add_volume(CLI::App& app);
Run add_devices(CLI::App& app);

}  // namespace kiln::cli
