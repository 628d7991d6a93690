// Reads smoothing groups of 3DS files, since Assimp only keeps the normals that it computes from them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// Smoothing groups and materials of the faces of a 3DS mesh, in file order.
struct Smoothing3ds {
  std::vector<std::uint32_t> masks;  ///< Mask of each face, one bit per smoothing group; 0: flat
  std::vector<std::uint32_t> materials;  ///< Index into `material_names` for each face
  /// Names in lower case; the first is for faces without a material
  std::vector<std::string> material_names;
};

/// Reads the smoothing groups of all meshes, in the file's order. Masks are all 0 if the file has no information about
/// edges: without groups, or from MeshLab, which writes one mask into every face. Damaged files are read up to the
/// damage.
std::vector<Smoothing3ds> read_smoothing_3ds(std::string_view bytes);

/// A part of a mesh. Assimp splits meshes by material, and keeps the faces in file order.
struct Part3ds {
  std::string material;  ///< Name of the part's material; case is ignored
  std::size_t faces = 0;
};

/// Distributes the masks of a mesh's faces to its parts. Faces without a material, or with a material that no part has,
/// belong to one of the parts.
/// \returns the masks of each part's faces; nullopt if parts and mesh do not match
std::optional<std::vector<std::vector<std::uint32_t>>> masks_of_parts(
    const Smoothing3ds& mesh, std::span<const Part3ds> parts);

}  // namespace kiln
