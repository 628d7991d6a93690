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
  /// Nodes, and materials in the order of Mesh::material_names, if requested. Its mesh only has names of objects, which
  /// `object_nodes` refers to.
  Asset beside;
  Mesh hulls;  ///< Collision hulls that were taken off; see take_collision_hulls()

  /// The file of a triangle.
  const std::string& file_of(std::size_t triangle) const;
};

/// Reads the files, or uses meshes in memory, and joins them. Files of materials are searched from the first file's
/// folder. A single mesh is unchanged, unless the other side of the bake has several meshes: then its parts get names.
/// \param named   a file without groups or objects becomes one group with the file's name
/// \param beside  true: also reads MeshFiles::beside, and warns if an MTL cannot be read ("materials-unread")
/// \throws Error(input) as load_mesh()
MeshFiles load_meshes(const std::vector<JobInput>& inputs, const LoadMeshOptions& options,
                      bool named, std::vector<Warning>& warnings, bool beside = false);

/// Reduces the materials read with a mesh to those that the mesh still names, after triangles were removed.
void name_materials(MeshFiles& files);

/// Gives each group of triangles its own UVs, transformed by `move`.
void move_uvs(const std::vector<std::size_t>& group_of,
              const std::function<Vec2(std::size_t group, const Vec2& uv)>& move, Mesh& mesh);

/// Rewrites the paths of material files relative to another folder; empty: the current one.
void move_material_files(Mesh& mesh, const std::filesystem::path& from,
                         const std::filesystem::path& to);

/// "'a.obj'", "'a.obj' and 'b.obj'", "'a.obj', 'b.obj' and 3 more".
std::string in_words(const std::vector<std::string>& files);

/// Warns if the UV layouts of different files overlap without being identical: they cannot share a map.
void warn_of_shared_texels(const MeshFiles& low, std::vector<Warning>& warnings);

/// The role of a mesh file; other: an occluder.
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

/// \throws Error(usage) for an invalid value, for a value of a side without files, and for a value of both sides that
///         applies to no file
void check_mesh_frame(const MeshFrameArguments& arguments, const std::vector<std::string>& high,
                      const std::vector<std::string>& low, const std::vector<std::string>& others);

/// \throws OptionError for other words than x, y, z, -x, -y and -z
UpAxis parse_up(const std::string& text);

/// A value of one side overrides its files; a value of both sides only applies to files that do not state one.
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
