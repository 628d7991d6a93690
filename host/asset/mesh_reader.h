// The mesh readers, and the input that they share.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/lower_case.h"
#include "kiln/error.h"
#include "kiln/mesh.h"

namespace kiln {

struct Asset;

enum class MeshFormat { ply, obj, stl, off, gltf, saved, fbx, assimp };

/// A mesh file in memory, with the options for reading it.
struct MeshInput {
  std::string file;                          ///< Path as the caller gave it, for messages
  std::string_view bytes;                    ///< The file's contents
  std::vector<Warning>* warnings = nullptr;  ///< Warnings are appended to this list; may be null
  LoadMeshOptions options = {};
  /// Folder of the files that this one refers to (buffers, pictures); nullopt: such files are not
  /// read
  std::optional<std::filesystem::path> folder = {};

  /// Throws Error(input) "<file>: <place>: <problem>. <remedy>." The place may be empty.
  [[noreturn]] void fail(const std::string& place, const std::string& problem,
                         const Message& remedy) const;
  void warn(std::string code, const Message& message, std::uint64_t count) const;
};

/// Parses a mesh in memory with one of the readers below, after checking that its contents match
/// `format`. It does not read outside of `bytes`; memory and time are linear in their number.
/// \param whole  [out] the whole asset of a glTF; may be null
/// \throws Error(input)
Mesh parse_mesh(const MeshInput& input, MeshFormat format, Asset* whole = nullptr);

/// Reads a mesh file, as load_mesh() does.
/// \param whole  [out] the whole asset of a glTF or FBX; may be null
Mesh load_mesh_file(const std::filesystem::path& path, const LoadMeshOptions& options,
                    std::vector<Warning>* warnings, Asset* whole);

/// True for .glb, .gltf and .vrm, which is a GLB.
inline bool is_gltf_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".glb" || extension == ".gltf" || extension == ".vrm";
}
inline bool is_fbx_name(const std::filesystem::path& path) {
  return lower_extension(path) == ".fbx";
}
/// True for the formats that Assimp reads: .dae, .3ds and .x.
inline bool is_assimp_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".dae" || extension == ".3ds" || extension == ".x";
}
inline bool is_ply_name(const std::filesystem::path& path) {
  return lower_extension(path) == ".ply";
}
/// True if files of this format contain their materials, unlike OBJ, which refers to an MTL.
inline bool has_own_materials(const std::filesystem::path& path) {
  return is_gltf_name(path) || is_fbx_name(path) || is_assimp_name(path) || is_ply_name(path);
}

/// Paths of the MTL files that a mesh names. The names may have the separators of Windows.
/// \param folder  folder of the mesh
std::vector<std::filesystem::path> material_file_paths(const Mesh& mesh,
                                                       const std::filesystem::path& folder);

/// The readers of the formats. Each throws Error(input) if a file cannot be used, and appends all
/// other problems to input.warnings.
Mesh read_ply(const MeshInput& input);
Mesh read_obj(const MeshInput& input);
Mesh read_stl(const MeshInput& input);
Mesh read_off(const MeshInput& input);

}  // namespace kiln
