// The subcommands. Each add_...() function adds its options to the command line and returns the function to run.
#pragma once

#include <array>
#include <functional>
#include <string_view>

#include "arguments/command_line.h"

namespace kiln::cli {

/// Runs a parsed subcommand; returns the exit code.
using Run = std::function<int()>;

/// A command of a program.
struct CommandEntry {
  std::string_view name;
  Run (*add)(Command& app);  ///< nullptr: kiln-lab runs the command, and only help lists it here
};

/// The commands that kiln-lab runs (tools/lab), with their help texts.
inline constexpr std::array<std::array<std::string_view, 2>, 3> kLabCommands = {{
    {"measure",
     "Rate the matches on two meshes; one mesh's UVs; or, with --study, how errors depend on "
     "views, faces and map size"},
    {"chart",
     "Speed against accuracy of every match, or of every way to map a volume: a plot, "
     "a table and the figures"},
    {"gallery",
     "Pictures of every match side by side: the low poly with each map, where each is "
     "wrong, and where texels land on HIGH"},
}};
/// The lab command that the words run or request help for; nullptr if it is none.
const char* asked_of_lab(int argc, char** argv);

/// Replaces this process by kiln-lab with the same words. It is searched beside this program and in the installation
/// folder.
/// \param command  for the message
/// \returns the exit code, after a message, if it cannot be run
int run_lab(const char* command, char** argv);
/// Adds a lab command without its options, for help.
Command* name_lab_command(Command& app, std::string_view name);

Run add_bake(Command& app);
Run add_run(Command& app);
Run add_simplify(Command& app);
Run add_render(Command& app);
Run add_measure(Command& app);
Run add_chart(Command& app);
Run add_gallery(Command& app);
Run add_diff(Command& app);
Run add_view(Command& app);
Run add_volume(Command& app);
Run add_devices(Command& app);

}  // namespace kiln::cli
