// The flags of the bake command, part by part.
#pragma once

#include "arguments/bake_arguments.h"
#include "arguments/command_line.h"

namespace kiln::cli {

/// More files of HIGH and of LOW.
void add_file_list_flags(Command& command, BakeArguments& arguments);
void add_map_flags(Command& command, BakeArguments& arguments);
/// Of maps that take more than the point: occlusion and curvature.
void add_detail_flags(Command& command, BakeArguments& arguments);
/// Of textures of the high poly, and of how files hold maps.
void add_file_flags(Command& command, BakeArguments& arguments);
/// How points are found, whatever the match.
void add_match_flags(Command& command, BakeArguments& arguments);
/// Of depth views and of visibility.
void add_view_flags(Command& command, BakeArguments& arguments);
/// Of the height field, of the low poly that Kiln makes, and of the run itself.
void add_run_flags(Command& command, BakeArguments& arguments);

}  // namespace kiln::cli
