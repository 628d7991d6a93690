// Reads mesh files with the options that apply to them, and joins several files to one scene.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/job.h"
#include "kiln/mesh.h"
#include "kiln/normals.h"
#include "options/option_table.h"

namespace kiln {

/// A mesh that was read from one or several files.
struct MeshFiles {
  Mesh mesh;
  std::vector<std::string> files;
  /// Index of the first triangle of each file, then the number of all triangles
  std::vector<std::size_t> first;
  /// Nodes, and materials in the order of Mesh::material_names, if requested. Its `mesh` holds only names of objects,
  /// to which `object_nodes` refers.
  Asset nodes_and_materials;
  Mesh hulls;  ///< Collision hulls that were removed from `mesh`; see take_collision_hulls()

  /// The file that a triangle comes from.
  const std::string& file_of(std::size_t triangle) const;
};

/// Reads the files, or uses meshes in memory, and joins them. MTL files are searched for from the first file's folder.
/// A single mesh is unchanged, unless the other mesh of the bake has several files: then the parts of this mesh get
/// names.
/// \param named   true: a file without groups or objects becomes one group with the file's name
/// \param with_materials  true: also reads MeshFiles::nodes_and_materials, and warns if an MTL cannot be read
///                         ("materials-unread")
/// \throws Error(input) as load_mesh()
MeshFiles load_meshes(const std::vector<JobInput>& inputs, const LoadMeshOptions& options,
                      bool named, std::vector<Warning>& warnings, bool with_materials = false);

/// Reduces the materials of the files to those that the mesh still names, after triangles were removed.
void keep_named_materials(MeshFiles& files);

/// Gives each group of triangles UVs of its own, transformed by `move`.
void move_uvs(const std::vector<std::size_t>& group_of,
              const std::function<Vec2(std::size_t group, const Vec2& uv)>& move, Mesh& mesh);

/// Rewrites the paths of material files relative to the folder `to`, or to the current folder if `to` is empty.
void move_material_files(Mesh& mesh, const std::filesystem::path& from,
                         const std::filesystem::path& to);

/// Lists file names for messages: "'a.obj'", "'a.obj' and 'b.obj'", "'a.obj', 'b.obj' and 3 more".
std::string quote_files(const std::vector<std::string>& files);

/// Warns if the UV layouts of different files overlap without being identical, since they cannot share a map.
void warn_of_shared_texels(const MeshFiles& low, std::vector<Warning>& warnings);

/// The role of a mesh file: `high` and `low` are the meshes of the bake, `other` is an occluder.
enum class MeshSide { high, low, other };

/// Parses a value of --high-normals: "auto", "file", "smooth", "flat" or an angle. \throws Error(usage)
ShadingOptions parse_shading(const std::string& text);
std::string shading_rule_name(const ShadingOptions& options);

/// Option rows for jobs with a member `frame`. \param low  true if the command reads LOW as well as HIGH
template <typename Job>
std::vector<OptionRow> mesh_frame_rows(const char* group, bool low) {
  const std::string sides = low ? "; high=VALUE and low=VALUE override the files of that mesh"
                                : "; high=VALUE overrides what the files state";
  return {
      {.flag = "--up",
       .group = group,
       .value = texts(KILN_MEMBER(Job, frame.up)),
       .help =
           "Up axis of files that do not state it (OBJ, PLY, STL, OFF): x, y, z, -x, -y, -z; they "
           "are rotated to Y up. glTF, FBX and DAE state it" +
           sides},
      {.flag = "--unit",
       .group = group,
       .value = texts(KILN_MEMBER(Job, frame.unit)),
       .help = "Unit of files that do not state it (OBJ, PLY, STL, OFF, 3DS, X): mm, cm, m, in, ft "
               "or a "
               "number of metres; they are scaled to metres. glTF, FBX and DAE state it" +
               sides},
      {.flag = "--uv-set",
       .group = group,
       .value = texts(KILN_MEMBER(Job, frame.uv_set)),
       .help = std::string("UV set to read: a number from 0 on, or a name (FBX)") +
               (low ? "; high= and low= select it for one mesh" : "")},
      {.flag = "--allow-outside",
       .group = group,
       .value = toggle(KILN_MEMBER(Job, frame.allow_outside)),
       .help = "Allow glTF, FBX, DAE, 3DS and X to refer to files outside their folder",
       .key = "-"},
      {.flag = "--high-normals",
       .group = group,
       .value = value_of<Job>(
           "frame.shading", "text", "auto|file|smooth|flat|ANGLE",
           [](Job& job, const Message&, const OptionWords& words) {
             job.frame.shading = parse_shading(words.back());
           },
           [](Job& job) { return shading_rule_name(job.frame.shading); }),
       .help =
           "Source of HIGH's normals. auto: its file; if it has none, smooth for a scan, and with "
           "hard edges for a hard surface, as the angles at its edges suggest; file: its file, "
           "else smooth; smooth, flat: everywhere; ANGLE: edges that bend by at least this many "
           "degrees are hard"}};
}

/// Checks the options of `arguments` against the files that they apply to.
/// \throws Error(usage) for an invalid value, for a value of HIGH or LOW if that has no files, and for a value of both
///   that applies to no file
void check_mesh_frame(const MeshFrameArguments& arguments, const std::vector<std::string>& high,
                      const std::vector<std::string>& low, const std::vector<std::string>& others);

/// Parses a value of --up. \throws OptionError for words other than x, y, z, -x, -y and -z
UpAxis parse_up(const std::string& text);

/// Options for reading the files of HIGH or of LOW. A value for this mesh alone overrides its files; a value for both
/// meshes only applies to files that do not state one.
/// \throws Error(usage)
LoadMeshOptions load_options(const MeshFrameArguments& arguments, MeshSide side);

/// Variant of load_options() that includes the triangulation of polygons, for jobs with members `frame` and `load`.
/// \throws Error(usage)
template <typename Job>
LoadMeshOptions load_options(const Job& job, MeshSide side) {
  LoadMeshOptions options = load_options(job.frame, side);
  options.triangulation = job.load.triangulation;
  return options;
}

}  // namespace kiln
