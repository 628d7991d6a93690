// Smoothing groups of 3DS files, of which Assimp keeps the normals alone that it makes of them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln {

/// What a 3DS file says of a mesh's faces, in their order.
struct Smoothing3ds {
  std::vector<std::uint32_t> masks;         ///< A bit a smoothing group; 0: flat
  std::vector<std::uint32_t> materials;     ///< Indices into `material_names`
  std::vector<std::string> material_names;  ///< In lower case; the first is of faces without
};

/// One for each mesh of a file, in order. A file whose faces say nothing of edges has masks of 0 alone: those without
/// groups, and those of MeshLab, which writes one mask into every face of any mesh. Of a damaged file, as far as it is whole.
std::vector<Smoothing3ds> read_smoothing_3ds(std::string_view bytes);

/// A part of a mesh that Assimp made of the faces of one material, in the file's order.
struct Part3ds {
  std::string material;  ///< Of any case
  std::size_t faces = 0;
};

/// The masks of each part's faces. Faces without a material, or of one that is none of the parts', are in one of them.
/// \returns nothing where parts and mesh do not fit together
std::optional<std::vector<std::vector<std::uint32_t>>> masks_of_parts(
    const Smoothing3ds& mesh, std::span<const Part3ds> parts);

}  // namespace kiln
