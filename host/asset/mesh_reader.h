// Shared by the mesh readers: the file's bytes, and errors.
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

enum class MeshFormat { ply, obj, stl, off, gltf, fbx, assimp };

/// A mesh file in memory.
struct MeshInput {
  std::string file;                          ///< Path as the caller gave it; used in messages.
  std::string_view bytes;                    ///< The content.
  std::vector<Warning>* warnings = nullptr;  ///< Receives warnings; may be null.
  LoadMeshOptions options = {};
  /// Folder of referenced files (buffers, pictures). None: they are not read.
  std::optional<std::filesystem::path> folder = {};

  /// Throws Error(input): "<file>: <place>: <problem>. <remedy>." The place may be empty.
  [[noreturn]] void fail(const std::string& place, const std::string& problem,
                         const Message& remedy) const;
  void warn(std::string code, const Message& message, std::uint64_t count) const;
};

/// Reads a mesh from memory: calls a reader below after a check that the content matches `format`.
/// Never reads outside `bytes`; memory and time are linear in their number.
/// \throws Error(input)
/// \param whole  receives the whole asset of a glTF; may be null
Mesh parse_mesh(const MeshInput& input, MeshFormat format, Asset* whole = nullptr);

/// load_mesh() of a path. \param whole  as above
Mesh load_mesh_file(const std::filesystem::path& path, const LoadMeshOptions& options,
                    std::vector<Warning>* warnings, Asset* whole);

/// True for .glb, .gltf and .vrm, which is a .glb.
inline bool is_gltf_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".glb" || extension == ".gltf" || extension == ".vrm";
}
inline bool is_fbx_name(const std::filesystem::path& path) {
  return lower_extension(path) == ".fbx";
}
/// True for formats read by Assimp: .dae, .3ds and .x.
inline bool is_assimp_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".dae" || extension == ".3ds" || extension == ".x";
}
inline bool is_ply_name(const std::filesystem::path& path) {
  return lower_extension(path) == ".ply";
}
/// True if a file describes its own materials, unlike OBJ, which names an MTL.
inline bool has_own_materials(const std::filesystem::path& path) {
  return is_gltf_name(path) || is_fbx_name(path) || is_assimp_name(path) || is_ply_name(path);
}

/// Readers of the formats. Each throws Error(input) for unusable files, and appends other faults to
/// input.warnings.
Mesh read_ply(const MeshInput& input);
Mesh read_obj(const MeshInput& input);
Mesh read_stl(const MeshInput& input);
Mesh read_off(const MeshInput& input);

}  // namespace kiln
