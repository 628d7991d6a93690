#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/material.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

struct BakedMap;

/// A node of a file's hierarchy (glTF, FBX).
struct AssetNode {
  /// The parent of a root.
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::string name = {};         ///< As the file has it; need not be unique
  std::uint32_t parent = kNone;  ///< Index into Asset::nodes, below the node's own; kNone: a root
  std::array<double, 16> transform{1, 0, 0, 0, 0, 1, 0, 0,
                                   0, 0, 1, 0, 0, 0, 0, 1};  ///< To the parent, column-major
  std::string extras = {};       ///< JSON of glTF's `extras`; empty: none
  std::string mesh_extras = {};  ///< ... of its mesh
};

/// A mesh with its materials and the hierarchy it came from: what a glTF or FBX holds. The mesh has all nodes'
/// instances in world space, an object each (Mesh::objects) and its materials by name (Mesh::materials).
struct Asset {
  Mesh mesh = {};                        ///< In world space
  std::vector<Material> materials = {};  ///< One for each of Mesh::material_names, in order
  std::vector<AssetNode> nodes =
      {};  ///< Parents before children; empty: a format without hierarchy
  std::vector<std::uint32_t> object_nodes =
      {};                      ///< Per object of the mesh, index into nodes; empty with `nodes`
  std::string extras = {};     ///< JSON of glTF's `asset.extras`; empty: none
  std::string copyright = {};  ///< glTF's `asset.copyright`
  std::string scene = {};      ///< JSON of the glTF scene that was read; empty: none, or several
};

/// Reads a mesh with its materials and hierarchy: glTF 2.0 (.glb, .vrm; .gltf with its buffers beside it or in it). Of all
/// other formats it is load_mesh(), and load_materials() where the files that the mesh names are there: no nodes.
///
/// glTF: all nodes of the default scene (else of all scenes; else all), each one with a mesh an object, whose name is
/// the node's, else the mesh's; where two are the same, ".001" and so on follow. Mirrored nodes keep their outside.
/// Materials alike; primitives without one have "default". Vertex colours become sRGB bytes. Without normals,
/// triangles are flat. Morph targets are added by their default weights; a skinned mesh lies where the nodes of its
/// joints put it, and its own node's transform has no part in that. UVs get their origin at the lower left; quantised
/// ones are scaled by the transform of their material's pictures. Files beside it are read from its folder and those in
/// it alone, also where symbolic links lead elsewhere, but for LoadMeshOptions::outside. Read are KHR_mesh_quantization,
/// EXT_mesh_gpu_instancing (an object each), EXT_meshopt_compression, KHR_draco_mesh_compression where Draco was built in,
/// KHR_texture_transform, EXT_texture_webp, KHR_texture_basisu (KTX 2 without Basis Universal), MSFT_texture_dds and KHR_materials_emissive_strength; KHR_materials_pbrSpecularGlossiness is
/// converted: its diffuse becomes the colour, 1 - glossiness the roughness. A file that requires any other extension,
/// but for KHR_materials_*, is refused. Warnings, beside those of load_mesh():
///   ignored-primitives  points and lines: left out
///   flat-normals        triangles without normals
///   rest-pose           skins, taken in their pose at rest, and morph targets, taken by their default weights: what
///                       save_asset() writes has neither
///   unweighted-vertices of skins: they lie where the mesh's own node puts them
///   uv-transforms       pictures of one material that scale quantised UVs differently
///   scene-child         nodes that a scene lists beside their parents: read once
///   bright-colors       vertex colours above 1: cut off
///   material-extensions KHR_materials_* whose looks no map holds (clearcoat, transmission...): left out
///   nearest-filter      samplers of hard texels: taken as linear
///   picture-missing     pictures that are not there: the factor stands alone
/// \throws Error(input), as load_mesh() and load_materials()
/// Thread safety: may be called from several threads. Memory and time are linear in the files' sizes, and in what
/// the nodes place.
Asset load_asset(const std::filesystem::path& path, const LoadMeshOptions& options = {},
                 std::vector<Warning>* warnings = nullptr);

/// Baked maps of one texture set, by what a material takes them for; null: there is none. Values as files hold
/// them: normals as n/2 + 1/2 with +Y up, colours sRGB-encoded, all in [0, 1]. Those of occlusion, roughness and
/// metalness, which share a picture, have one size; so have colour and opacity.
struct AssetMaps {
  const Image* normal = nullptr;     ///< Tangent space
  const Image* occlusion = nullptr;  ///< First channel, as of the next three
  const Image* roughness = nullptr;  ///< First channel
  const Image* metallic = nullptr;   ///< First channel
  const Image* opacity = nullptr;    ///< First channel
  const Image* color = nullptr;      ///< Three channels
  const Image* emission = nullptr;   ///< Three channels
  float emission_strength = 1;       ///< Linear light that 1 in `emission` stands for; at least 0
  std::span<const std::uint8_t> coverage =
      {};  ///< BakeResult::coverage, for AssetPictures::errors; may be empty
};

/// The place of a map in a material, by its name; null: it has none. Any thread may call it.
const Image** slot_of(AssetMaps& maps, std::string_view name);

/// Brings the maps of a bake to what a material takes: emission into [0, 1] with its strength, the shape's ambient
/// occlusion darkened by the high poly's picture of it (the lesser of both), normals of the high poly's normal maps in
/// place of its shape's. \returns places in `maps`, which must outlive it
/// \param store  called with a map and its name before it gets its place, to bring values to what files hold (sRGB for
///               colours); empty: they are so already
/// \param left   where to append the names of maps that a material has no place for, with commas; may be null
/// Thread safety: may be called from several threads, for maps of their own.
AssetMaps asset_maps(std::span<BakedMap> maps,
                     const std::function<void(BakedMap&, const std::string&)>& store = {},
                     std::string* left = nullptr);

/// Error of a map as the asset's picture stores it: see stored_error().
struct AssetError {
  std::string_view map = {};  ///< "normal", "ao", "color"...: as maps() and transfers have it
  bool is_normal = false;     ///< Degrees; else steps of 1/255
  StoredError error = {};     ///< Error over the baked texels
};

/// The same as pictures that glTF has, 8 bits. Made by encode_maps(). Each says by its first bytes what it is: PNG, WebP
/// or JPEG.
struct AssetPictures {
  std::vector<AssetError> errors = {};  ///< Each map's error, where its texels are baked
  /// PNGs beside WebPs, for programs that do not read these: EncodeMapsOptions::fallback. As the members below.
  std::shared_ptr<const AssetPictures> fallback = {};
  std::uint32_t normal_quality =
      0;  ///< That EncodeMapsOptions::max_normal_error came to; 0: lossless
  std::vector<std::byte> color =
      {};  ///< Base colour, with opacity as its alpha; empty, as all: none
  std::vector<std::byte> surface = {};   ///< Occlusion, roughness and metalness: R, G, B
  std::vector<std::byte> normal = {};    ///< In tangent space
  std::vector<std::byte> emission = {};  ///< sRGB
  bool has_color = false;                ///< Else `color` is white
  bool has_opacity = false;              ///< `color` has an alpha channel
  bool has_occlusion = false;            ///< Else it is 1 in `surface`
  bool has_surface = false;              ///< Roughness, or metalness, is in `surface`
  bool has_metallic = false;             ///< Else it is 0
  float emission_strength = 1;           ///< As in AssetMaps
};

/// Formats of a glTF's pictures.
enum class PictureFormat {
  png,   ///< 8 bits
  webp,  ///< Lossless, or lossy by a quality: EXT_texture_webp. Where libwebp was built in; at most 16383 texels a side
  jpeg,  ///< Lossy. Where libjpeg was built in; at most 65500 texels a side
};

/// How values become 8 bits.
enum class Dither {
  off,  ///< Rounded to nearest
  /// Dithered where rounding would leave bands: a channel is dithered in each square of 32 x 32 texels in which it changes by
  /// less than one step of 1/255, but by more than 1/16 of one; all else is rounded. Of normals x and y alone: z hardly
  /// turns them.
  automatic,
  on,  ///< Ordered dither everywhere (Bayer's thresholds, 8 x 8)
};

/// Settings of encode_maps().
struct EncodeMapsOptions {
  /// With webp EXT_texture_webp becomes required, but with `fallback`. With jpeg, pictures with alpha, which it does not have,
  /// are PNGs; so are normals, but with `max_normal_error`.
  PictureFormat format = PictureFormat::png;
  /// webp and jpeg: 1 to 100, lossy: of all pictures but normals. 0: webp is lossless, jpeg has 90. Colours may have half
  /// the resolution.
  std::uint32_t quality = 0;
  /// webp and jpeg: normals are lossy, too, in the least quality with which their mean error is no more degrees than this. 0:
  /// they are lossless.
  double max_normal_error = 0;
  Dither dither = Dither::automatic;  ///< Lossy pictures are rounded
  bool smallest = false;              ///< PNGs are packed for seconds, for the fewest bytes
  bool fallback = false;              ///< webp: PNGs stand beside, and no extension is required
};

/// Encodes maps, so that their values need not be kept, and several materials can share them. The same maps give the same
/// bytes, on any number of threads.
/// \throws Error(usage) for maps of other channels or sizes than they should have, and other formats
/// Thread safety: may be called from several threads.
AssetPictures encode_maps(const AssetMaps& maps, const EncodeMapsOptions& options = {});
/// The same of png8 or webp.
AssetPictures encode_maps(const AssetMaps& maps, ImageFormat format);

/// A material of a file that is written.
struct AssetMaterial {
  std::string name = {};  ///< Need not be unique
  std::shared_ptr<const AssetPictures> pictures =
      {};                                  ///< Null: none. What several share is in the file once
  AlphaMode alpha_mode = AlphaMode::mask;  ///< Applied where its pictures have opacity; else opaque
  float alpha_cutoff = 0.5F;               ///< Threshold of AlphaMode::mask
  bool double_sided = false;               ///< Back faces are shown, too
  std::string set = {};                    ///< Beginning of its pictures' names; may be empty
  std::string extras = {};                 ///< JSON: glTF's `extras`; empty: none
};

/// How the triangles of a glTF are packed.
enum class MeshCompression {
  none,
  /// EXT_meshopt_compression over KHR_mesh_quantization, both required: positions in 1/65535 of an object's longest side,
  /// normals and tangents within 0.04 degrees, UVs in 1/65535 where all lie in [0, 1]; a node below each object's own scales
  /// them back. Triangles and vertices are reordered.
  meshopt,
  /// KHR_draco_mesh_compression, required: positions and UVs in 16 bits, normals and tangents in 12. Triangles and vertices
  /// are reordered. Where Draco was built in.
  draco,
};

/// Settings of save_asset(), and content beside a mesh and its materials.
struct SaveAssetOptions {
  std::vector<AssetNode> nodes = {};  ///< As Asset::nodes; empty: a node an object
  std::vector<std::uint32_t> object_nodes =
      {};  ///< As Asset::object_nodes; AssetNode::kNone: a root of its own
  /// Collision hulls beside the mesh: written as they are, without UVs, materials and colours; null: none. Not kept.
  const Mesh* hulls = nullptr;
  std::vector<std::uint32_t> hull_nodes = {};  ///< As object_nodes, of the hulls' objects
  double metres = 0;             ///< A unit of the mesh, which becomes the root's scale; 0: 1
  std::string extras = {};       ///< JSON: `asset.extras`, an object; empty: none
  std::string copyright = {};    ///< `asset.copyright`; empty: none
  std::string scene = {};        ///< As Asset::scene, whose name and extras are written
  std::string kiln_extras = {};  ///< JSON: becomes `asset.extras.kiln`; empty: none
  MeshCompression compression = MeshCompression::none;  ///< Of all meshes
};

/// Writes a low poly with its maps as glTF 2.0: POSITION, NORMAL, TANGENT and TEXCOORD_0 as a bake in tangent space
/// takes them (the file's tangents, or MikkTSpace's). A name that ends in .gltf gives NAME.gltf, NAME.bin and the
/// pictures NAME_color.png and so on beside it, any other name one binary file.
///
/// Nodes keep names, parents, transforms and extras; each object lies in the space of its node, with a primitive a
/// material. An object whose node mirrors it, or has another one already, gets a node of its own below, which undoes
/// the mirroring: programs do not agree on tangents under mirroring nodes. An object whose node flattens it is a
/// root. Without nodes, the root is named as the mesh, and its origin is the root's translation. Vertex colours are
/// COLOR_0, but where a material has a picture of colours: there they would be multiplied, and are `_COLOR_0`.
/// Triangles without area are left out. Those without UVs, where others have them, are a primitive of their own, whose material has no pictures. A mesh without UVs has no tangents. Each file appears whole or not at all, the .gltf last.
/// \param materials  one for each of Mesh::material_names, or one for all
/// \returns the files that were written, `path` last
/// \throws Error(input) for a mesh without a triangle that has area, or without UVs but with pictures; Error(usage) for materials or nodes of
///         another number, or extras that are no JSON; Error(output), also beyond the 4 GiB of a GLB
/// Thread safety: may be called from several threads, for files of different names.
std::vector<std::filesystem::path> save_asset(const Mesh& low,
                                              std::span<const AssetMaterial> materials,
                                              const std::filesystem::path& path,
                                              const SaveAssetOptions& options = {});

/// The bytes of the GLB that save_asset() would write.
/// \throws as save_asset(), but for Error(output) of the disk
/// Thread safety: may be called from several threads.
std::vector<std::byte> encode_glb(const Mesh& low, std::span<const AssetMaterial> materials,
                                  const SaveAssetOptions& options = {});

/// Settings of save_glb(), and content beside a mesh and its maps.
struct SaveGlbOptions {
  AlphaMode alpha_mode = AlphaMode::mask;  ///< Applied where there is AssetMaps::opacity
  float alpha_cutoff = 0.5F;               ///< Threshold of AlphaMode::mask
  bool double_sided = false;               ///< Back faces are shown, too
  double metres = 0;        ///< A unit of the mesh, which becomes the root's scale; 0: 1
  std::string extras = {};  ///< JSON: becomes `asset.extras.kiln`; empty: none
};

/// save_asset() of one material, named as the mesh, and without a hierarchy.
void save_glb(const Mesh& low, const AssetMaps& maps, const std::filesystem::path& path,
              const SaveGlbOptions& options = {});

}  // namespace kiln
