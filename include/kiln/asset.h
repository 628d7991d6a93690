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
#include "kiln/image_data.h"
#include "kiln/material.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

struct BakedMap;
enum class ImageFormat;

/// A node of a file's hierarchy (glTF, FBX).
struct AssetNode {
  /// Value of `parent` for a root.
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::string name = {};  ///< Name of the node in the file; several nodes may have the same
  /// Index into Asset::nodes, lower than the node's own; kNone for a root
  std::uint32_t parent = kNone;
  /// Transform to the parent, column-major
  std::array<double, 16> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  std::string extras = {};       ///< JSON of glTF's `extras`; empty: none
  std::string mesh_extras = {};  ///< JSON of glTF's `extras` of the node's mesh; empty: none
};

/// A mesh with its materials and the hierarchy it came from: the content of a glTF or FBX file. The mesh holds
/// the instances of all nodes in world space, one object per instance (Mesh::objects), and materials by name
/// (Mesh::materials).
struct Asset {
  Mesh mesh = {};  ///< All instances of all nodes, in world space
  /// One material per entry of Mesh::material_names, in that order
  std::vector<Material> materials = {};
  /// Parents before children; empty for formats without a hierarchy
  std::vector<AssetNode> nodes = {};
  std::vector<std::uint32_t> object_nodes =
      {};  ///< Per object of the mesh, index into `nodes`; empty if `nodes` is empty
  std::string extras = {};     ///< JSON of glTF's `asset.extras`; empty: none
  std::string copyright = {};  ///< Text of glTF's `asset.copyright`
  /// JSON of the glTF scene that was read; empty if there is none, or if several were read
  std::string scene = {};
};

/// Reads a mesh with its materials and hierarchy: glTF 2.0 (.glb, .vrm; .gltf with its buffers beside it or in it).
/// Other formats are read by load_mesh(), and by load_materials() if the files that the mesh names exist; they have no
/// nodes.
///
/// glTF: the nodes of the default scene are read; without a default scene those of all scenes, without scenes all
/// nodes. Each node with a mesh becomes an object. The object takes the node's name, else the mesh's; repeated names
/// get the suffixes ".001" and so on. Mirrored nodes keep their outside. Repeated names of materials get suffixes, too;
/// primitives without a material use "default". Vertex colours become sRGB bytes. Meshes without normals are shaded
/// flat. Morph targets are added by their default weights; a skinned mesh lies where the nodes of its joints place it;
/// the transform of its own node is ignored. UVs get their origin at the lower left; quantised ones are scaled by the
/// transform of their material's pictures. Referenced files must lie in the file's folder or below, after symbolic
/// links are resolved; LoadMeshOptions::outside lifts this. Supported extensions: KHR_mesh_quantization,
/// EXT_mesh_gpu_instancing (an object each), EXT_meshopt_compression, KHR_draco_mesh_compression where Draco was built
/// in, KHR_texture_transform, EXT_texture_webp, KHR_texture_basisu (KTX 2 without Basis Universal), MSFT_texture_dds
/// and KHR_materials_emissive_strength; KHR_materials_pbrSpecularGlossiness is converted: its diffuse becomes the
/// colour, 1 - glossiness the roughness. A file that requires another extension is refused; KHR_materials_* are
/// accepted. Warnings, beside those of load_mesh():
///   ignored-primitives  points and lines, which are dropped
///   flat-normals        triangles without normals
///   rest-pose           skins, read in their rest pose, and morph targets, read with their default weights:
///                       save_asset() writes neither
///   unweighted-vertices vertices of skins without weights: the mesh's own node places them
///   uv-transforms       pictures of one material that scale quantised UVs differently
///   scene-child         nodes that a scene lists beside their parents: read once
///   bright-colors       vertex colours above 1: clamped
///   material-extensions KHR_materials_* without a map in Kiln (clearcoat, transmission...): ignored
///   nearest-filter      samplers with nearest filtering: read as linear
///   picture-missing     missing pictures: the factor alone is used
/// \throws Error(input), as load_mesh() and load_materials()
/// Thread safety: may be called from several threads. Memory and time are linear in the files' sizes, and in the
/// instances of the nodes.
Asset load_asset(const std::filesystem::path& path, const LoadMeshOptions& options = {},
                 std::vector<Warning>* warnings = nullptr);

/// Reads an asset from the bytes of a whole file, which are not kept. Other files that it refers to (buffers, MTL,
/// pictures beside it) are not read; embedded pictures, as in a GLB, are copied into their materials.
/// \param name  for messages; its extension selects the format
/// \throws as load_asset(path)
Asset load_asset(std::span<const std::byte> bytes, std::string_view name,
                 const LoadMeshOptions& options = {}, std::vector<Warning>* warnings = nullptr);

/// Baked maps of one texture set, by their slots in a material; null: the slot is empty. Values are encoded as
/// in files: normals as n/2 + 1/2 with +Y up, colours as sRGB, all in [0, 1]. Occlusion, roughness and metalness
/// share a picture, so they must have one size; likewise colour and opacity.
struct AssetMaps {
  const Image* normal = nullptr;     ///< Normals in tangent space
  const Image* occlusion = nullptr;  ///< Only its first channel is used
  const Image* roughness = nullptr;  ///< Only its first channel is used
  const Image* metallic = nullptr;   ///< Only its first channel is used
  const Image* opacity = nullptr;    ///< Only its first channel is used
  const Image* color = nullptr;      ///< A colour in three channels
  const Image* emission = nullptr;   ///< A colour in three channels
  /// Linear radiance of the value 1 in `emission`; at least 0
  float emission_strength = 1;
  std::span<const std::uint8_t> coverage =
      {};  ///< BakeResult::coverage, for AssetPictures::errors; may be empty
};

/// The slot of a material that a map of this name fills; null if there is none. Any thread may call
/// it.
const Image** slot_of(AssetMaps& maps, std::string_view name);

/// Assigns the maps of a bake to the slots of a material. Emission is scaled into [0, 1], with its strength. Ambient
/// occlusion is the lesser of the baked value and of the high poly's occlusion picture. If several maps fit one
/// slot, the last one is used, so that a transferred normal map replaces the map normal.
/// \returns pointers into `maps`, which must outlive the result
/// \param maps  maps of bake(); those that are not yet converted are converted by to_stored()
/// \param left  receives the names of maps that fit no slot of a material, separated by commas; may be null
/// Thread safety: may be called from several threads, for different maps.
AssetMaps asset_maps(std::span<BakedMap> maps, std::string* left = nullptr);

/// Error of a map in the encoded picture: see stored_error().
struct AssetError {
  std::string_view map = {};  ///< Name of the map as in maps() and transfers, such as "normal"
  bool is_normal = false;     ///< True: the error is in degrees; false: in steps of 1/255
  StoredError error = {};     ///< The map's error over its baked texels
};

/// Maps encoded as 8-bit pictures for a glTF, by encode_maps(). The first bytes of each buffer identify its format:
/// PNG, WebP or JPEG.
struct AssetPictures {
  std::vector<AssetError> errors = {};  ///< Error of each map over its baked texels
  /// PNG versions of WebP pictures, for programs that cannot read WebP; see EncodeMapsOptions::fallback. Null:
  /// none.
  std::shared_ptr<const AssetPictures> fallback = {};
  /// Quality of the normal map's picture, chosen by EncodeMapsOptions::max_normal_error; 0:
  /// lossless
  std::uint32_t normal_quality = 0;
  /// Base colour, with opacity as alpha. Here and below, an empty picture is absent
  std::vector<std::byte> color = {};
  std::vector<std::byte> surface = {};   ///< R: occlusion; G: roughness; B: metalness
  std::vector<std::byte> normal = {};    ///< Normals in tangent space
  std::vector<std::byte> emission = {};  ///< Emission, sRGB-encoded
  bool has_color = false;       ///< True: `color` holds a colour map; false: its colour is white
  bool has_opacity = false;     ///< True if `color` has an alpha channel
  bool has_occlusion = false;   ///< True: `surface` holds occlusion; false: its occlusion is 1
  bool has_surface = false;     ///< True if `surface` holds roughness or metalness
  bool has_metallic = false;    ///< True: `surface` holds metalness; false: its metalness is 0
  float emission_strength = 1;  ///< Linear radiance of the value 1 in `emission`
};

/// Picture formats of a glTF.
enum class PictureFormat {
  png,  ///< 8 bits
  /// Lossless, or lossy at a quality: EXT_texture_webp. In builds with libwebp; at most 16383 texels a side
  webp,
  jpeg,  ///< Lossy. In builds with libjpeg; at most 65500 texels a side
};

/// Quantisation of values to 8 bits.
enum class Dither {
  off,  ///< Values are rounded to nearest
  /// Dithered only where rounding would cause banding: a channel is dithered in each square of 32 x 32 texels in which
  /// it changes by less than one step of 1/255, but by more than 1/16 of a step. Elsewhere values are rounded. Normals
  /// dither x and y alone, since z hardly changes their direction.
  automatic,
  on,  ///< Ordered dither everywhere (Bayer's thresholds, 8 x 8)
};

/// Settings of encode_maps().
struct EncodeMapsOptions {
  /// webp makes EXT_texture_webp a required extension, unless `fallback` is set. jpeg has no alpha, so pictures with
  /// alpha are PNGs; so are normals, unless `max_normal_error` is set.
  PictureFormat format = PictureFormat::png;
  /// webp and jpeg: quality of lossy pictures, 1 to 100; normals stay lossless. 0: webp is lossless, jpeg uses 90.
  /// Lossy colours may be stored at half resolution.
  std::uint32_t quality = 0;
  /// webp and jpeg: encodes normals lossily, at the lowest quality whose mean error does not exceed this angle,
  /// degrees. 0: normals are lossless.
  double max_normal_error = 0;
  Dither dither = Dither::automatic;  ///< Dither of lossless pictures; lossy ones are not dithered
  bool smallest = false;  ///< Search for the smallest PNG, which takes seconds per picture
  bool fallback = false;  ///< webp: add PNG versions, so that no extension is required
};

/// Encodes maps, so that float images need not be kept, and so that several materials can share the pictures. The same
/// maps give the same bytes on any number of threads.
/// \throws Error(usage) for maps with a wrong number of channels or mismatched sizes, and for unsupported formats
/// Thread safety: may be called from several threads.
AssetPictures encode_maps(const AssetMaps& maps, const EncodeMapsOptions& options = {});
/// Encodes as png8 or webp.
AssetPictures encode_maps(const AssetMaps& maps, ImageFormat format);

/// A material to write to an asset.
struct AssetMaterial {
  std::string name = {};  ///< Name of the material; several materials may have the same
  /// Pictures of the maps; null: none. Pictures that several materials share are written once
  std::shared_ptr<const AssetPictures> pictures = {};
  /// Alpha mode if the pictures have opacity; else the material is opaque
  AlphaMode alpha_mode = AlphaMode::mask;
  float alpha_cutoff = 0.5F;  ///< Threshold of AlphaMode::mask
  bool double_sided = false;  ///< Renderers show back faces, too
  std::string set = {};       ///< Prefix of the names of its pictures' files; may be empty
  std::string extras = {};    ///< JSON of glTF's `extras`; empty: none
};

/// Compression of the geometry of a glTF.
enum class MeshCompression {
  none,
  /// EXT_meshopt_compression over KHR_mesh_quantization, both required: positions in 1/65535 of an object's longest
  /// side, normals and tangents within 0.04 degrees, UVs in 1/65535 where all lie in [0, 1]; an extra node below each
  /// object's node undoes the scaling. Triangles and vertices are reordered.
  meshopt,
  /// KHR_draco_mesh_compression, required: positions and UVs in 16 bits, normals and tangents in 12. Triangles and
  /// vertices are reordered. In builds with Draco.
  draco,
};

/// A coarser level of detail in an asset of save_asset().
struct AssetLevel {
  Mesh low = {};  ///< The level's low poly
  /// One material per entry of `low`'s Mesh::material_names
  std::vector<AssetMaterial> materials = {};
  /// Per object of `low`, index into SaveAssetOptions::nodes; AssetNode::kNone gives the object a root node
  std::vector<std::uint32_t> object_nodes = {};
  /// The level replaces the previous level where the asset covers at most this share of the view's
  /// height, 0 to 1. It must not exceed the previous level's value
  double coverage = 0;
};

/// Settings of save_asset(), and data to write in addition to a mesh and its materials.
struct SaveAssetOptions {
  /// The file's hierarchy, parents before children; empty: one node per object
  std::vector<AssetNode> nodes = {};
  /// Per object of the mesh, index into `nodes`; AssetNode::kNone gives the object a root node of its own
  std::vector<std::uint32_t> object_nodes = {};
  /// Collision hulls, written unchanged beside the mesh, without UVs, materials and colours; null: none. Must stay
  /// valid during the call.
  const Mesh* hulls = nullptr;
  /// Per object of `hulls`, index into `nodes`; AssetNode::kNone gives the hull a root node of its own
  std::vector<std::uint32_t> hull_nodes = {};
  double metres = 0;  ///< Metres per unit of the mesh, written as the scale of the root node; 0: 1
  std::string extras = {};     ///< JSON object for glTF's `asset.extras`; empty: none
  std::string copyright = {};  ///< Text for glTF's `asset.copyright`; empty: none
  /// JSON of a glTF scene (Asset::scene), whose name and extras are written; empty: none
  std::string scene = {};
  std::string kiln_extras = {};  ///< JSON for glTF's `asset.extras.kiln`; empty: none
  /// Coarser levels of detail to write into the same file, by the extension MSFT_lod. Readers that do not
  /// support it show only the mesh that is given to save_asset(), the first level.
  std::vector<AssetLevel> levels = {};
  MeshCompression compression = MeshCompression::none;  ///< Compression of all meshes of the file
};

/// Writes a low poly with its maps as glTF 2.0: POSITION, NORMAL, TANGENT and TEXCOORD_0 as bakes in tangent space use
/// them (the mesh's own tangents, else MikkTSpace's). A name that ends in .gltf gives NAME.gltf, NAME.bin and the
/// pictures NAME_color.png and so on beside it, any other name one binary file.
///
/// Nodes keep names, parents, transforms and extras; each object lies in the space of its node, with one primitive per
/// material. An object gets an extra node below its own if that node holds another object already, or mirrors it; the
/// extra node undoes the mirroring, since programs disagree on tangents under mirroring nodes. An object whose node has
/// a singular transform becomes a root. Without nodes, the root is named as the mesh, and its origin is the root's
/// translation. Vertex colours are COLOR_0. For materials with a colour picture they are `_COLOR_0`, since renderers
/// would multiply both. Triangles without area are left out. In a mesh with UVs, triangles without UVs form a primitive
/// whose material has no pictures. A mesh without UVs has no tangents. Each file appears whole or not at all, the .gltf
/// last.
///
/// With SaveAssetOptions::levels one node holds all nodes of the mesh; its extension MSFT_lod lists a node for each
/// further level, which no scene lists. Its extras have MSFT_screencoverage: for each level the coverage down to which it
/// is shown, 0 for the last. Pictures and materials that levels share are written once.
/// \param materials  one for each of Mesh::material_names, or one for all
/// \returns paths of the written files, `path` last
/// \throws Error(input) for a mesh without a triangle that has area, or without UVs but with pictures; Error(usage) for
///         a wrong number of materials or nodes, coverages that rise or are out of range, or extras that are not JSON;
///         Error(output), also for a GLB beyond 4 GiB
/// Thread safety: may be called from several threads, for files of different names.
std::vector<std::filesystem::path> save_asset(const Mesh& low,
                                              std::span<const AssetMaterial> materials,
                                              const std::filesystem::path& path,
                                              const SaveAssetOptions& options = {});

/// Encodes the GLB that save_asset() would write, in memory.
/// \throws as save_asset(), without errors of the disk
/// Thread safety: may be called from several threads.
std::vector<std::byte> encode_glb(const Mesh& low, std::span<const AssetMaterial> materials,
                                  const SaveAssetOptions& options = {});

/// Settings of save_glb(), and data to write in addition to a mesh and its maps.
struct SaveGlbOptions {
  AlphaMode alpha_mode = AlphaMode::mask;  ///< Alpha mode if AssetMaps::opacity is set
  float alpha_cutoff = 0.5F;               ///< Threshold of AlphaMode::mask
  bool double_sided = false;               ///< Renderers show back faces, too
  double metres = 0;  ///< Metres per unit of the mesh, written as the scale of the root node; 0: 1
  std::string extras = {};  ///< JSON for glTF's `asset.extras.kiln`; empty: none
};

/// save_asset() with one material, named as the mesh, and no hierarchy.
void save_glb(const Mesh& low, const AssetMaps& maps, const std::filesystem::path& path,
              const SaveGlbOptions& options = {});

}  // namespace kiln
