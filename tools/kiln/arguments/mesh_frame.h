// Axes, units and UV sets of mesh files: --up, --unit, --uv-set, --allow-outside.
#pragma once

#include <string>
#include <vector>

#include "arguments/option_table.h"
#include "kiln/mesh.h"

namespace kiln::cli {

/// As written: VALUE, high=VALUE or low=VALUE, each once at most.
struct MeshFrameArguments {
  std::vector<std::string> up, unit, uv_set;
  bool allow_outside = false;

  bool given() const { return !up.empty() || !unit.empty() || !uv_set.empty() || allow_outside; }
};

/// Whose file it is; other: an occluder.
enum class MeshSide { high, low, other };

/// Rows of jobs with a member `frame`. \param low  whether the command has LOW as well as HIGH
template <typename Job>
std::vector<OptionRow> mesh_frame_rows(const char* group, bool low) {
  const std::string sides = low ? "; high=VALUE, low=VALUE: of that side, whatever it says"
                                : "; high=VALUE: whatever it says";
  return {
      {.flag = "--up",
       .group = group,
       .value = texts(KILN_MEMBER(Job, frame.up)),
       .help = "Which axis is up in files that do not say (OBJ, PLY, STL, OFF): x, y, z, -x, -y, "
               "-z; they are turned to Y up. glTF, FBX and DAE say it" +
               sides},
      {.flag = "--unit",
       .group = group,
       .value = texts(KILN_MEMBER(Job, frame.unit)),
       .help = "The unit of files that do not say (OBJ, PLY, STL, OFF, 3DS, X): mm, cm, m, in, "
               "ft or metres; they are scaled to metres. glTF, FBX and DAE say it" +
               sides},
      {.flag = "--uv-set",
       .group = group,
       .value = texts(KILN_MEMBER(Job, frame.uv_set)),
       .help = std::string("Which of several sets of UVs: a number from 0 on, or its name (FBX)") +
               (low ? "; high=, low=: of that side" : "")},
      {.flag = "--allow-outside",
       .group = group,
       .value = toggle(KILN_MEMBER(Job, frame.allow_outside)),
       .help = "Pictures that FBX, DAE, 3DS and X name may lie outside the folder of the file",
       .key = "-"}};
}

/// \throws Error(usage) for a value that is none, for a side without files, and where no file is one that a value of
///         both sides would be for
void check_mesh_frame(const MeshFrameArguments& arguments, const std::vector<std::string>& high,
                      const std::vector<std::string>& low, const std::vector<std::string>& others);

/// A value of one side holds whatever its files say, one of both sides for those that do not say it.
/// \throws Error(usage)
LoadMeshOptions load_options(const MeshFrameArguments& arguments, MeshSide side);

/// The same, with how polygons become triangles, of jobs with members `frame` and `load`. \throws Error(usage)
template <typename Job>
LoadMeshOptions load_options(const Job& job, MeshSide side) {
  LoadMeshOptions options = load_options(job.frame, side);
  options.triangulation = job.load.triangulation;
  return options;
}

}  // namespace kiln::cli
