// What mesh files are in: --up, --unit, --uv-set, --allow-outside.
#pragma once

#include <string>
#include <vector>

#include "arguments/command_line.h"
#include "kiln/mesh.h"

namespace kiln::cli {

/// As written: VALUE, high=VALUE or low=VALUE, each once at most.
struct MeshFrameArguments {
  std::vector<std::string> up, unit, uv_set;
  bool allow_outside = false;
};

/// Whose file it is; other: an occluder.
enum class MeshSide { high, low, other };

/// \param low  whether the command has LOW as well as HIGH
void add_mesh_frame_options(Command& command, MeshFrameArguments& arguments, bool low,
                            const std::string& group);

/// \throws Error(usage) for a value that is none, for a side without files, and where no file is one that a value of
///         both sides would be for
void check_mesh_frame(const MeshFrameArguments& arguments, const std::vector<std::string>& high,
                      const std::vector<std::string>& low, const std::vector<std::string>& others);

/// A value of one side holds whatever its files say, one of both sides for those that do not say it.
/// \throws Error(usage)
LoadMeshOptions load_options(const MeshFrameArguments& arguments, MeshSide side);

}  // namespace kiln::cli
