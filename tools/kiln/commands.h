// Declares the commands. Each add_...() function adds its options to the command line and returns the function to run.
#pragma once

#include <array>
#include <functional>
#include <string_view>

#include "arguments/command_line.h"

namespace kiln::cli {

/// Runs a parsed command, and returns the exit code.
using Run = std::function<int()>;

/// A command of the program, for its list of commands.
struct CommandEntry {
  std::string_view name;
  /// Function that runs the command. Null: kiln-lab runs it, and this program only lists it in help
  Run (*add)(Command& app);
};

/// The commands that kiln-lab runs (tools/lab), with their help texts.
inline constexpr std::array<std::array<std::string_view, 2>, 3> kLabCommands = {{
    {"measure",
     "Rate the matches on two meshes, or the UVs of one; with --study, measure how errors depend "
     "on views, faces and map size"},
    {"chart",
     "Chart speed against accuracy of every match, or of every way to map a volume: a plot, a "
     "table and the figures"},
    {"gallery",
     "Draw pictures of every match side by side: the low poly with each map, the errors, and the "
     "points on HIGH of the texels"},
}};
/// Returns the lab command that the words run or request help for; null if they do not.
const char* requested_lab_command(int argc, char** argv);

/// Replaces this process by kiln-lab with the same words. kiln-lab is searched for beside this program and in the
/// installation folder.
/// \param command  name of the command, for the message
/// \returns the exit code, after a message, if kiln-lab cannot be started
int run_lab(const char* command, char** argv);
/// Adds a lab command without its options, for help.
Command* add_lab_command_name(Command& app, std::string_view name);

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
