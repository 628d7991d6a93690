#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"
#include "kiln/mesh.h"
#include "kiln/texture.h"

namespace KILN_PUBLIC kiln {

/// Origin of a number of a material.
enum class MaterialNumber {
  none,       ///< The file says nothing of it: the default stands
  given,      ///< A statement of its own
  converted,  ///< Other statements: see Material
};

/// A picture that a material names, and how it lies on the surface.
struct MaterialPicture {
  std::filesystem::path file = {};  ///< Path; of an embedded picture, its name in messages
  /// The bytes of a picture that the mesh's file embeds, PNG, JPEG and so on; null: they are in `file`.
  std::shared_ptr<const std::vector<std::byte>> bytes = {};
  /// The channel that counts where the slot is a number (opacity, roughness, metalness, occlusion), 0 to 3;
  /// -1: the slot's usual one, which is the first, of opacity the alpha of a colour.
  int channel = -1;
  std::uint32_t uv_set = 0;  ///< Set of UVs that it lies on
  /// From the mesh's UVs to the picture's, both with the origin at the lower left, two rows of an affine map:
  /// u' = m[0] u + m[1] v + m[2], v' = m[3] u + m[4] v + m[5].
  std::array<float, 6> uv_transform{1, 0, 0, 0, 1, 0};
  std::array<TextureWrap, 2> wrap{};  ///< Along u and v, beyond the picture
  bool inverted = false;              ///< True if 1 minus the channel counts (glossiness)

  /// True if there is no picture.
  bool empty() const noexcept { return file.empty() && bytes == nullptr; }
};

/// Treatment of a material's opacity.
enum class AlphaMode {
  opaque,  ///< Opacity is ignored
  mask,    ///< Below Material::alpha_cutoff nothing is there
  blend,   ///< Transparent
};

/// A material as an MTL file, a glTF or an FBX describes it. Pictures are empty where it names none. Numbers are
/// multiplied with the pictures where the format says so (glTF); MTL's numbers stand where there is no picture.
struct Material {
  std::string name = {};                ///< As Mesh::material_names has it
  std::array<float, 3> color{1, 1, 1};  ///< `Kd`, linear light
  float opacity = 1;                    ///< `d`, or 1 - `Tr`; of `Tr 1` alone 1
  float roughness = 1;  ///< `Pr`, or else 1 - sqrt(`Ns` / 1000), as Blender writes it
  float metallic = 0;   ///< `Pm`; or else, in Blender's files, `Ka` where `illum` reflects, or 0
  std::array<float, 3> emission{};          ///< `Ke`, linear light
  float normal_scale = 1;                   ///< glTF's: of the normal map's x and y
  float occlusion_strength = 1;             ///< glTF's
  AlphaMode alpha_mode = AlphaMode::blend;  ///< MTL has no word for it
  float alpha_cutoff = 0.5F;                ///< Threshold of AlphaMode::mask
  bool double_sided = false;                ///< glTF's
  bool multiplies = false;                  ///< True if numbers are factors of the pictures (glTF)
  bool vertex_opacity = false;  ///< True if vertex colours that it multiplies have alpha
  bool vertex_color = false;    ///< True if it has the vertices' colours (PLY, without a picture)
  MaterialPicture color_map =
      {};  ///< `map_Kd`; alpha as well where opacity_map is the same picture
  MaterialPicture opacity_map = {};    ///< `map_d`
  MaterialPicture normal_map = {};     ///< `norm`, `map_Kn`, or else `map_Bump`, `bump`
  MaterialPicture roughness_map = {};  ///< `map_Pr`, or else, in Blender's files, `map_Ns`
  MaterialPicture metallic_map = {};   ///< `map_Pm`, or else, in Blender's files, `map_refl`
  MaterialPicture emission_map = {};   ///< `map_Ke`
  MaterialPicture occlusion_map = {};  ///< glTF's, FBX's
  MaterialNumber color_from = MaterialNumber::none;      ///< Origin of `color`
  MaterialNumber roughness_from = MaterialNumber::none;  ///< Origin of `roughness`
  MaterialNumber metallic_from = MaterialNumber::none;   ///< Origin of `metallic`
  MaterialNumber emission_from = MaterialNumber::none;   ///< Origin of `emission`
  std::string extras = {};                               ///< JSON of glTF's `extras`; empty: none
  std::string place =
      {};  ///< File and line of its `newmtl`, or its index; empty: no file describes it
};

/// Which of a material's pictures.
enum class MaterialSlot { color, opacity, normal, roughness, metallic, emission, occlusion };

/// Reads the MTL files that a mesh names, beside it, or the materials of a glTF file, or a PLY's pictures. Files and pictures that are not where they are named are
/// looked for in the mesh's folder and the folders in it: four levels, of at most 20,000 entries. Of several with
/// the name, the one is taken whose folders are named most alike, then the one that is nearest, then the first by
/// the alphabet. Nothing is kept. Thread safety of both functions: may be called from several threads.
/// \param mesh_file  the mesh's own path
/// \param warnings   where to append what was imperfect; may be null: "material-missing" for names that no
///                   file describes, "texture-options" for placements that are left out, "ignored-pictures" for
///                   those of statements that Kiln does not know, "found-elsewhere", "materials-differ" for a name
///                   that two files describe otherwise (the first is taken), "blender-pictures" where
///                   `map_Ns` or `map_refl` is taken, "transparency-of-one" for `Tr 1` without `d`
/// \param outside    as LoadMeshOptions::outside
/// \returns one for each of Mesh::material_names, in order
/// \throws Error(input) where a file is missing or has a number that is none
std::vector<Material> load_materials(const Mesh& mesh, const std::filesystem::path& mesh_file,
                                     std::vector<Warning>* warnings = nullptr,
                                     bool outside = false);

/// Loads one of the pictures of each material; where one has none, its number stands in. The texture shares
/// its pictures with its copies.
/// \param warnings  where to append what was imperfect; may be null: "material-value" for materials without
///                  picture and number: the default stands, "roughness-from-ns" and "metallic-from-illum" for
///                  numbers that are converted, "bump-is-height" for grey pictures, which are no normal maps:
///                  flat
/// Names with `<UDIM>`, `<UVTILE>` or `%(UDIM)d` are sets (Texture::tiles). So are names with a tile's number where the
/// mesh's UVs leave the first square and there are pictures for the others; "udim-siblings" says so, and where it is not
/// clear enough. Pictures of colour are weighted by their alpha where a material's opacity is read from it: of glTF unless
/// its alphaMode is OPAQUE, of MTL and others unless opacity has a picture of its own.
/// Without the mesh, all tiles of a set are loaded, and numbers count for nothing.
/// \param uv_set    that the mesh was read with (LoadMeshOptions)
/// \throws Error(input) where a picture is missing or damaged; where no material has one, or a number (opacity and
///         occlusion: 1; normals: a picture); where one lies on another set of UVs
Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot,
                              std::vector<Warning>* warnings = nullptr, std::uint32_t uv_set = 0);

/// The same for a mesh whose materials these are: a picture may lie on any of its sets of UVs, see Mesh::other_uvs, and of
/// UDIM sets the tiles that it uses are loaded.
/// \param normals  Texture::normal_format
/// \throws Error(input) where one lies on a set that the mesh has not
Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot,
                              const Mesh& mesh, std::vector<Warning>* warnings = nullptr,
                              NormalTextureFormat normals = NormalTextureFormat::automatic);

/// True for the name of a file, and of a UDIM set of which any tile is there. Any thread.
bool is_picture_file(const std::filesystem::path& path);

/// Loads a picture for all of a mesh, or a UDIM set, as load_material_texture() has it. The kind is linear where the file
/// holds linear light (holds_linear_light()), else srgb.
/// \throws Error(input) where a picture is missing or damaged
Texture load_texture(const std::filesystem::path& file, const Mesh* mesh = nullptr,
                     std::vector<Warning>* warnings = nullptr);

/// Report of cut_out().
struct CutOutReport {
  std::uint64_t whole = 0;  ///< Triangles that stayed as they were
  std::uint64_t cut = 0;    ///< Triangles of which a part stayed
  std::uint64_t gone = 0;   ///< Triangles that are transparent everywhere
};

/// Takes the transparent parts off a mesh (an alpha test), so that no ray, view or nearest point meets them:
/// leaves on cards, fences, hair.
///
/// Triangles with texels on both sides of the threshold are quartered, down to a
/// texel's size. There they are cut along the line between their corners' values. So borders are as
/// smooth as the texture read bilinearly. Parts without area are left out. New triangles lie in the old ones and have their normals,
/// UVs, colours and names. Computed normals are those of the whole mesh. Reads its arguments during
/// the call alone. Thread safety: may be called from several threads.
/// \param opacity    its `channel` is read; must have pictures
/// \param threshold  above 0, to 1: less is transparent
/// \throws Error(input) where the mesh has no UVs, the texture does not fit, or nothing is left;
///         Error(usage) for a threshold out of range
Mesh cut_out(const Mesh& mesh, const Texture& opacity, double threshold,
             CutOutReport* report = nullptr);

}  // namespace kiln
