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

/// Where a number of a material comes from.
enum class MaterialNumber {
  none,       ///< The file says nothing of it: the default stands
  given,      ///< A statement of its own
  converted,  ///< Other statements: see Material
};

/// A material as an MTL file describes it. Paths are empty where it names no such picture.
struct Material {
  std::string name;                     ///< As Mesh::material_names has it
  std::array<float, 3> color{1, 1, 1};  ///< `Kd`, linear light
  float opacity = 1;                    ///< `d`, or 1 - `Tr`
  float roughness = 1;  ///< `Pr`, or else 1 - sqrt(`Ns` / 1000), as Blender writes it
  float metallic = 0;   ///< `Pm`; or else, in Blender's files, `Ka` where `illum` reflects, or 0
  std::array<float, 3> emission{};       ///< `Ke`, linear light
  std::filesystem::path color_file;      ///< `map_Kd`
  std::filesystem::path opacity_file;    ///< `map_d`
  std::filesystem::path normal_file;     ///< `norm`, `map_Kn`, or else `map_Bump`, `bump`
  std::filesystem::path roughness_file;  ///< `map_Pr`, or else, in Blender's files, `map_Ns`
  std::filesystem::path metallic_file;   ///< `map_Pm`, or else, in Blender's files, `map_refl`
  std::filesystem::path emission_file;   ///< `map_Ke`
  MaterialNumber color_from = MaterialNumber::none;      ///< Of `color`
  MaterialNumber roughness_from = MaterialNumber::none;  ///< Of `roughness`
  MaterialNumber metallic_from = MaterialNumber::none;   ///< Of `metallic`
  MaterialNumber emission_from = MaterialNumber::none;   ///< Of `emission`
  std::string place;  ///< File and line of its `newmtl`; empty: no file describes it
};

/// Which of a material's pictures.
enum class MaterialSlot { color, opacity, normal, roughness, metallic, emission };

/// Reads the MTL files that a mesh names, beside it. Files and pictures that are not where they are named are
/// looked for in the mesh's folder and the folders in it: four levels, of at most 20,000 entries. Of several with
/// the name, the one is taken whose folders are named most alike, then the one that is nearest, then the first by
/// the alphabet. Nothing is kept. Thread safety of both functions: may be called from several threads.
/// \param mesh_file  the mesh's own path
/// \param warnings   where to append what was imperfect; may be null: "material-missing" for names that no
///                   file describes, "texture-options" for placements that are left out, "ignored-pictures" for
///                   those of statements that Kiln does not know, "found-elsewhere", "blender-pictures" where
///                   `map_Ns` or `map_refl` is taken
/// \returns one for each of Mesh::material_names, in order
/// \throws Error(input) where a file is missing or has a number that is none
std::vector<Material> load_materials(const Mesh& mesh, const std::filesystem::path& mesh_file,
                                     std::vector<Warning>* warnings = nullptr);

/// Loads one of the pictures of each material; where one has none, its number stands in. The texture shares
/// its pictures with its copies.
/// \param warnings  where to append what was imperfect; may be null: "material-value" for materials without
///                  picture and number: the default stands, "roughness-from-ns" and "metallic-from-illum" for
///                  numbers that are converted, "bump-is-height" for grey pictures, which are no normal maps:
///                  flat
/// \throws Error(input) where a picture is missing or damaged; where no material has one, or a number (opacity:
///         1; normals: a picture)
Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot,
                              std::vector<Warning>* warnings = nullptr);

}  // namespace kiln
