// Several mesh files that are parts of one scene, read as one mesh.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/kiln.h"

namespace kiln::cli {

/// A mesh that was read from one file or several.
struct MeshFiles {
  Mesh mesh;
  std::vector<std::string> files;
  std::vector<std::size_t> first;  ///< Of each file's triangles, and their number
  /// Contents beside the mesh, where asked for: nodes, and materials as Mesh::material_names; of its own
  /// mesh names of objects alone, as `object_nodes` counts them.
  Asset beside;

  /// The file of a triangle.
  const std::string& file_of(std::size_t triangle) const;
};

/// Reads files and joins them. One alone stays as it is, but where the other side of a bake has several: then
/// its parts have names, too. Files of materials are found from the first file's folder on.
/// \param named   a file without groups or objects is one of the file's name
/// \param beside  reads MeshFiles::beside; warns where an MTL cannot be read ("materials-unread")
/// \throws Error(input) as load_mesh()
MeshFiles load_meshes(const std::vector<std::string>& files, const LoadMeshOptions& options,
                      bool named, std::vector<Warning>& warnings, bool beside = false);

/// Names the files of materials as they are found from another folder on. Empty: the current one.
void move_material_files(Mesh& mesh, const std::filesystem::path& from,
                         const std::filesystem::path& to);

/// "'a.obj'", "'a.obj' and 'b.obj'", "'a.obj', 'b.obj' and 3 more".
std::string in_words(const std::vector<std::string>& files);

/// Says where UVs of different files lie over each other, though they are not the same: one map cannot hold
/// both.
void warn_of_shared_texels(const MeshFiles& low, std::vector<Warning>& warnings);

}  // namespace kiln::cli
