// Smoothing groups of 3DS files, of which Assimp only keeps the normals computed from them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// Smoothing groups and materials of a 3DS mesh's faces, in file order.
struct Smoothing3ds {
  std::vector<std::uint32_t> masks;         ///< One bit per smoothing group; 0: flat
  std::vector<std::uint32_t> materials;     ///< Indices into `material_names`
  std::vector<std::string> material_names;  ///< In lower case; the first is for faces without a
                                            ///< material
};

/// One element per mesh of a file, in order. Masks are all 0 for files without information about edges: without groups,
/// or from MeshLab, which writes one mask into every face. Damaged files are read up to the damage.
std::vector<Smoothing3ds> read_smoothing_3ds(std::string_view bytes);

/// A part of a mesh: Assimp splits meshes by material, with faces in file order.
struct Part3ds {
  std::string material;  ///< Case is ignored
  std::size_t faces = 0;
};

/// The masks of each part's faces. Faces without a material, or with one of no part, belong to one of them.
/// \returns nothing if parts and mesh do not match
std::optional<std::vector<std::vector<std::uint32_t>>> masks_of_parts(
    const Smoothing3ds& mesh, std::span<const Part3ds> parts);

}  // namespace kiln
