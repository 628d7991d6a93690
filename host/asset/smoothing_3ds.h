// Reads smoothing groups of 3DS files, since Assimp only keeps the normals that it computes from them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// Smoothing groups and materials of the faces of a 3DS mesh, in the order of the file.
struct Smoothing3ds {
  /// For each face, one bit per smoothing group; 0: the face is flat
  std::vector<std::uint32_t> masks;
  /// For each face, the index of its material in `material_names`
  std::vector<std::uint32_t> materials;
  /// Names of materials in lower case; the first one is for faces without a material
  std::vector<std::string> material_names;
};

/// Reads the smoothing groups of all meshes, in the order of the file. All masks are 0 if the file
/// says nothing about edges: if it has no groups, or comes from MeshLab, which writes the same mask
/// for every face. A damaged file is read up to the damage.
std::vector<Smoothing3ds> read_smoothing_3ds(std::string_view bytes);

/// A part of a mesh. Assimp splits meshes by material, and keeps the order of faces.
struct Part3ds {
  std::string material;  ///< Name of the part's material; case is ignored
  std::size_t faces = 0;
};

/// Distributes the masks of a mesh's faces to its parts. Faces whose material is missing, or is
/// that of no part, belong to one of the parts.
/// \returns for each part, the masks of its faces; nullopt if parts and mesh do not match
std::optional<std::vector<std::vector<std::uint32_t>>> masks_of_parts(
    const Smoothing3ds& mesh, std::span<const Part3ds> parts);

}  // namespace kiln
