#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/texture.h"

namespace KILN_PUBLIC kiln {

/// A material as an MTL file describes it. Paths are empty where it names no such picture.
struct Material {
  std::string name;                      ///< As Mesh::material_names has it
  std::array<float, 3> color{1, 1, 1};   ///< `Kd`, linear light
  float opacity = 1;                     ///< `d`, or 1 - `Tr`
  float roughness = 1;                   ///< `Pr`
  float metallic = 0;                    ///< `Pm`
  std::array<float, 3> emission{};       ///< `Ke`, linear light
  std::filesystem::path color_file;      ///< `map_Kd`
  std::filesystem::path opacity_file;    ///< `map_d`
  std::filesystem::path normal_file;     ///< `norm`, `map_Kn`
  std::filesystem::path roughness_file;  ///< `map_Pr`
  std::filesystem::path metallic_file;   ///< `map_Pm`
  std::filesystem::path emission_file;   ///< `map_Ke`
};

/// Which of a material's pictures.
enum class MaterialSlot { color, opacity, normal, roughness, metallic, emission };

/// Reads the MTL files that a mesh names, beside it. Nothing is kept. Thread safety of both functions: may be
/// called from several threads.
/// \param mesh_file  the mesh's own path
/// \param warnings   where to append what was imperfect; may be null: "material-missing" for names that no
///                   file describes (white), "texture-options" for placements that are left out
/// \returns one for each of Mesh::material_names, in order
/// \throws Error(input) where a file is missing or has a number that is none
std::vector<Material> load_materials(const Mesh& mesh, const std::filesystem::path& mesh_file,
                                     std::vector<Warning>* warnings = nullptr);

/// Loads one of the pictures of each material; where one has none, its number stands in. The texture shares
/// its pictures with its copies.
/// \throws Error(input) where a picture is missing or damaged, or where no material has one or a number
Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot);

}  // namespace kiln
