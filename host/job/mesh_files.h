// Mesh files: how flags have them read, and several joined as one scene.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/job.h"
#include "kiln/kiln.h"
#include "kiln/mesh.h"
#include "kiln/normals.h"
#include "options/option_table.h"

namespace kiln {

/// A mesh that was read from one file or several.
struct MeshFiles {
  Mesh mesh;
  std::vector<std::string> files;
  std::vector<std::size_t> first;  ///< Of each file's triangles, and their number
  /// Contents beside the mesh, where asked for: nodes, and materials as Mesh::material_names; of its own
  /// mesh names of objects alone, as `object_nodes` counts them.
  Asset beside;
  Mesh hulls;  ///< Collision hulls that were taken off; see take_collision_hulls()

  /// The file of a triangle.
  const std::string& file_of(std::size_t triangle) const;
};

/// Reads files, or takes meshes in memory, and joins them. One alone stays as it is, but where the other side of a bake has several: then
/// its parts have names, too. Files of materials are found from the first file's folder on.
/// \param named   a file without groups or objects is one of the file's name
/// \param beside  reads MeshFiles::beside; warns where an MTL cannot be read ("materials-unread")
/// \throws Error(input) as load_mesh()
MeshFiles load_meshes(const std::vector<JobInput>& inputs, const LoadMeshOptions& options,
                      bool named, std::vector<Warning>& warnings, bool beside = false);

/// Gives what was read beside a mesh one material for each of its names, after some of these went with their triangles.
void name_materials(MeshFiles& files);

/// Gives each group of triangles UVs of its own, where `move` puts a group's UV.
void move_uvs(const std::vector<std::size_t>& group_of,
              const std::function<Vec2(std::size_t group, const Vec2& uv)>& move, Mesh& mesh);

/// Names the files of materials as they are found from another folder on. Empty: the current one.
void move_material_files(Mesh& mesh, const std::filesystem::path& from,
                         const std::filesystem::path& to);

/// "'a.obj'", "'a.obj' and 'b.obj'", "'a.obj', 'b.obj' and 3 more".
std::string in_words(const std::vector<std::string>& files);

/// Says where UVs of different files lie over each other, though they are not the same: one map cannot hold
/// both.
void warn_of_shared_texels(const MeshFiles& low, std::vector<Warning>& warnings);

/// Whose file it is; other: an occluder.
enum class MeshSide { high, low, other };

/// "auto", "file", "smooth", "flat" or an angle, as --high-normals takes it. \throws Error(usage)
ShadingOptions parse_shading(const std::string& text);
std::string shading_word(const ShadingOptions& options);

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
       .help = "Files that glTF, FBX, DAE, 3DS and X name may lie outside the folder of the file",
       .key = "-"},
      {.flag = "--high-normals",
       .group = group,
       .value = value_of<Job>(
           "frame.shading", "text", "auto|file|smooth|flat|ANGLE",
           [](Job& job, const Message&, const OptionWords& words) {
             job.frame.shading = parse_shading(words.back());
           },
           [](Job& job) { return shading_word(job.frame.shading); }),
       .help = "Where HIGH's normals come from. auto: of its file; if that has none, smooth where "
               "HIGH is a scan, with hard edges where it is a hard surface, as the angles at its "
               "edges show; file: smooth if it has none; smooth, flat: everywhere; ANGLE: edges "
               "that turn by so many degrees or more are hard"}};
}

/// \throws Error(usage) for a value that is none, for a side without files, and where no file is one that a value of
///         both sides would be for
void check_mesh_frame(const MeshFrameArguments& arguments, const std::vector<std::string>& high,
                      const std::vector<std::string>& low, const std::vector<std::string>& others);

/// \throws OptionError for other words than x, y, z, -x, -y and -z
UpAxis parse_up(const std::string& text);

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

}  // namespace kiln
