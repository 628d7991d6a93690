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

/// Origin of a material's value.
enum class MaterialNumber {
  none,       ///< The file does not state a value, and the default is used
  given,      ///< The file states this value
  converted,  ///< Converted from other values in the file, see Material
};

/// A picture of a material, and its mapping to the surface.
struct MaterialPicture {
  /// Path of the file; for an embedded picture its name in messages
  std::filesystem::path file = {};
  /// Content of a picture that is embedded in the mesh's file, as PNG, JPEG and so on; null: stored in
  /// `file`.
  std::shared_ptr<const std::vector<std::byte>> bytes = {};
  /// Channel that holds the value of slots with one number (opacity, roughness, metalness, occlusion), 0
  /// to 3. -1: the usual channel of the slot, which is the first, or for opacity the alpha of a colour.
  int channel = -1;
  std::uint32_t uv_set = 0;  ///< Index of its UV set
  /// Transform from the mesh's UVs to the picture's, both with the origin at the lower left, two rows of an
  /// affine map: u' = m[0] u + m[1] v + m[2], v' = m[3] u + m[4] v + m[5].
  std::array<float, 6> uv_transform{1, 0, 0, 0, 1, 0};
  std::array<TextureWrap, 2> wrap{};  ///< Wrap modes along u and v
  bool inverted = false;              ///< The value is 1 minus the channel (glossiness)

  /// True if there is no picture.
  bool empty() const noexcept { return file.empty() && bytes == nullptr; }
};

/// Treatment of a material's opacity.
enum class AlphaMode {
  opaque,  ///< Opacity is ignored
  mask,    ///< Surfaces with opacity below Material::alpha_cutoff are invisible
  blend,   ///< Transparent
};

/// A material of an MTL, glTF or FBX file. Slots without a picture are empty. In glTF, numbers are factors of
/// the pictures. In MTL and FBX, the number of a slot is only used if the slot has no picture; but `opacity` is a factor
/// of the alpha of color_map if there is no opacity_map.
struct Material {
  std::string name = {};                ///< Name as in Mesh::material_names
  std::array<float, 3> color{1, 1, 1};  ///< `Kd`, linear light
  float opacity = 1;    ///< `d`, or 1 - `Tr`; `Tr 1` without `d` counts as opaque (1)
  float roughness = 1;  ///< `Pr`, or else 1 - sqrt(`Ns` / 1000), the convention of Blender
  /// `Pm`; or else, in Blender's files, `Ka` if `illum` states reflection; else 0
  float metallic = 0;
  std::array<float, 3> emission{};          ///< `Ke`, linear light
  float normal_scale = 1;                   ///< glTF's factor of the normal map's x and y
  float occlusion_strength = 1;             ///< glTF's `occlusionTexture.strength`
  AlphaMode alpha_mode = AlphaMode::blend;  ///< Alpha mode; MTL files cannot state it
  float alpha_cutoff = 0.5F;                ///< Threshold of AlphaMode::mask
  bool double_sided = false;                ///< glTF's `doubleSided`
  bool multiplies = false;      ///< True if all numbers are factors of the pictures (glTF)
  bool vertex_opacity = false;  ///< True if vertex colours that it is multiplied with have alpha
  /// True if the material's colour comes from the vertices (PLY without a picture)
  bool vertex_color = false;
  /// `map_Kd`. In MTL and FBX, its alpha times `opacity` is the material's opacity if opacity_map is empty. If opacity_map
  /// is the same picture, the alpha is used as for any opacity_map: in glTF times `opacity`, in MTL and FBX alone
  MaterialPicture color_map = {};
  MaterialPicture opacity_map = {};    ///< `map_d`; in MTL and FBX, replaces `opacity`
  MaterialPicture normal_map = {};     ///< `norm`, `map_Kn`, or else `map_Bump`, `bump`
  MaterialPicture roughness_map = {};  ///< `map_Pr`, or else, in Blender's files, `map_Ns`
  MaterialPicture metallic_map = {};   ///< `map_Pm`, or else, in Blender's files, `map_refl`
  MaterialPicture emission_map = {};   ///< `map_Ke`
  MaterialPicture occlusion_map = {};  ///< glTF and FBX
  MaterialNumber color_from = MaterialNumber::none;      ///< Origin of `color`
  MaterialNumber roughness_from = MaterialNumber::none;  ///< Origin of `roughness`
  MaterialNumber metallic_from = MaterialNumber::none;   ///< Origin of `metallic`
  MaterialNumber emission_from = MaterialNumber::none;   ///< Origin of `emission`
  std::string extras = {};                               ///< JSON of glTF's `extras`; empty: none
  /// File and line of the material's `newmtl`, or the material's index in the file; empty: no file
  /// describes the material
  std::string place = {};
};

/// Slots of a material for pictures.
enum class MaterialSlot { color, opacity, normal, roughness, metallic, emission, occlusion };

/// Reads the materials of a glTF file, the pictures of a PLY, or the MTL files that a mesh names, which lie beside it.
/// Missing files and pictures are searched in the mesh's folder and its subfolders: four levels, at most 20,000
/// entries. Of several files with the name, the one whose folder names agree most with the path is used; of equal ones,
/// the nearest, and then the first in alphabetical order. No argument is kept. Thread safety of both functions: may be
/// called from several threads.
/// \param mesh_file  the mesh's own path
/// \param warnings   receives warnings; may be null: "material-missing" for names that no file describes,
///                   "texture-options" for placements that are ignored, "ignored-pictures" for pictures of unknown
///                   statements, "found-elsewhere", "materials-differ" for a name that two files describe differently
///                   (the first is taken), "blender-pictures" if `map_Ns` or `map_refl` is used, "transparency-of-one"
///                   for `Tr 1` without `d`
/// \param outside    as LoadMeshOptions::outside
/// \returns one for each of Mesh::material_names, in order
/// \throws Error(input) if a file is missing or has an invalid number
std::vector<Material> load_materials(const Mesh& mesh, const std::filesystem::path& mesh_file,
                                     std::vector<Warning>* warnings = nullptr,
                                     bool outside = false);

/// Loads the picture of one slot for each material; materials without a picture use their number. Copies of the texture
/// share its pictures.
/// \param warnings  receives warnings; may be null: "material-value" for materials without picture and number: the
///                  default is used, "roughness-from-ns" and "metallic-from-illum" for numbers that are converted,
///                  "bump-is-height": grey pictures, no normals, treated as flat; "two-channel-colors": as BC5
/// Names with `<UDIM>`, `<UVTILE>` or `%(UDIM)d` are sets (Texture::tiles). So are names with a tile's number if the
/// mesh's UVs leave the first square and pictures for the other tiles exist; the warning "udim-siblings" reports this,
/// and ambiguous cases. Colour pictures are weighted by their alpha if it is the material's opacity: in glTF unless
/// alphaMode is OPAQUE, in MTL and others unless opacity has its own picture. Without the mesh, all tiles of a set are
/// loaded, and numbers in names are ignored.
/// \param uv_set    the set that the mesh was read with (LoadMeshOptions)
/// \throws Error(input) if a picture is missing or damaged; if no material has a picture or number (opacity and
///         occlusion default to 1; normals need a picture); if one lies on another UV set
Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot,
                              std::vector<Warning>* warnings = nullptr, std::uint32_t uv_set = 0);

/// Loads the pictures of one slot, as the function above does, for a mesh with these materials:
/// pictures may use any of the mesh's UV sets (Mesh::other_uvs), and only the used tiles of UDIM
/// sets are loaded.
/// \param normals  Texture::normal_format
/// \throws Error(input) if a picture uses a UV set that the mesh lacks
Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot,
                              const Mesh& mesh, std::vector<Warning>* warnings = nullptr,
                              NormalTextureFormat normals = NormalTextureFormat::automatic);

/// True for an existing file, and for a UDIM set of which at least one tile exists. Any thread.
bool is_picture_file(const std::filesystem::path& path);

/// Loads one picture for a whole mesh, or a UDIM set, as load_material_texture() does. The kind is linear if the file
/// holds linear light (holds_linear_light()), else srgb.
/// \throws Error(input) if a picture is missing or damaged
Texture load_texture(const std::filesystem::path& file, const Mesh* mesh = nullptr,
                     std::vector<Warning>* warnings = nullptr);

/// Report of cut_out().
struct CutOutReport {
  std::uint64_t whole = 0;  ///< Triangles that were kept unchanged
  std::uint64_t cut = 0;    ///< Triangles that were cut at the threshold
  std::uint64_t gone = 0;   ///< Triangles that were removed, since they are transparent everywhere
};

/// Removes the transparent parts of a mesh (an alpha test), so that no ray, view or nearest point hits them: for leaves
/// on cards, fences and hair.
///
/// Triangles with texels on both sides of the threshold are quartered, down to a texel's size. There they are cut along
/// the threshold's line between the corners' values, so borders are as smooth as the bilinear texture. Pieces without
/// area are left out. New triangles lie in the old ones and inherit their normals, UVs, colours and names. Computed
/// normals are those of the whole mesh. Reads its arguments during the call alone. Thread safety: may be called from
/// several threads.
/// \param opacity    texture, of which Texture::channel is read; must have pictures
/// \param threshold  above 0, up to 1: lower opacity is transparent
/// \throws Error(input) if the mesh has no UVs, the texture does not fit, or no triangle is left; Error(usage) for a
///         threshold out of range
Mesh cut_out(const Mesh& mesh, const Texture& opacity, double threshold,
             CutOutReport* report = nullptr);

}  // namespace kiln
