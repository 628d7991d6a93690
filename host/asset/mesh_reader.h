// Declares the mesh readers, and their common input.
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
  std::vector<Warning>* warnings = nullptr;  ///< List that receives warnings; may be null
  LoadMeshOptions options = {};
  /// Folder of referenced files (buffers, pictures); nullopt: such files are not read
  std::optional<std::filesystem::path> folder = {};

  /// Throws Error(input) with the text "<file>: <place>: <problem>. <remedy>." The place may be empty.
  [[noreturn]] void fail(const std::string& place, const std::string& problem,
                         const Message& remedy) const;
  void warn(std::string code, const Message& message, std::uint64_t count) const;
};

/// Parses a mesh in memory, by one of the readers below, after a check that the contents match `format`. It never reads
/// outside `bytes`; memory and time are linear in their number. \throws Error(input)
/// \param whole  receives the whole asset of a glTF; may be null
Mesh parse_mesh(const MeshInput& input, MeshFormat format, Asset* whole = nullptr);

/// Reads a mesh file, as load_mesh() does. \param whole  receives the whole asset of a glTF or FBX; may be null
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
/// True if files of this format describe their own materials, unlike OBJ, which names an MTL.
inline bool has_own_materials(const std::filesystem::path& path) {
  return is_gltf_name(path) || is_fbx_name(path) || is_assimp_name(path) || is_ply_name(path);
}

/// Paths of the MTL files that a mesh names, whose separators may be those of Windows.
/// \param folder  the folder of the mesh's own file
std::vector<std::filesystem::path> material_file_paths(const Mesh& mesh,
                                                       const std::filesystem::path& folder);

/// The readers of the formats. Each throws Error(input) for unusable files, and appends all other problems to
/// input.warnings.
Mesh read_ply(const MeshInput& input);
Mesh read_obj(const MeshInput& input);
Mesh read_stl(const MeshInput& input);
Mesh read_off(const MeshInput& input);

}  // namespace kiln
