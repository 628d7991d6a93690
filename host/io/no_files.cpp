// For builds without file formats: all readers and writers exist, but throw an error.
#include <memory>
#include <string>

#include "io/file/byte_source.h"
#include "kiln/asset.h"
#include "kiln/height_field.h"
#include "kiln/image.h"
#include "kiln/match.h"
#include "kiln/material.h"
#include "kiln/mesh.h"
#include "kiln/volume.h"

namespace kiln {
namespace {

[[noreturn]] void fail(const std::string& name) {
  throw Error(ErrorCode::usage,
              "'" + name +
                  "' is a file, and this build of Kiln has no file formats: build it with "
                  "KILN_WITH_IO=ON, or read and write files yourself.",
              "no-files");
}

}  // namespace

Mesh load_mesh(const std::filesystem::path& path, std::vector<Warning>* /*warnings*/) {
  fail(path.string());
}
Mesh load_mesh(const std::filesystem::path& path, const LoadMeshOptions& /*options*/,
               std::vector<Warning>* /*warnings*/) {
  fail(path.string());
}
Asset load_asset(const std::filesystem::path& path, const LoadMeshOptions& /*options*/,
                 std::vector<Warning>* /*warnings*/) {
  fail(path.string());
}
Asset load_asset(std::span<const std::byte> /*bytes*/, std::string_view name,
                 const LoadMeshOptions& /*options*/, std::vector<Warning>* /*warnings*/) {
  fail(std::string(name));
}
Mesh load_mesh(std::span<const std::byte> /*bytes*/, std::string_view name,
               std::vector<Warning>* /*warnings*/) {
  fail(std::string(name));
}

std::vector<std::string> mesh_formats() { return {}; }

std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path, FailWith /*fail*/) {
  fail(path.string());
}

Image load_image(const std::filesystem::path& path) { fail(path.string()); }
Image load_image(std::span<const std::byte> /*bytes*/, std::string_view name) {
  fail(std::string(name));
}
std::vector<std::string> picture_formats() { return {}; }
Heights load_heights(const std::filesystem::path& path, std::vector<Warning>* /*warnings*/) {
  fail(path.string());
}
bool holds_linear_light(const std::filesystem::path& path) { fail(path.string()); }
void save_image(const Image& /*image*/, const std::filesystem::path& path,
                const SaveImageOptions& /*options*/) {
  fail(path.string());
}
std::vector<std::byte> encode(const Image& /*image*/, const SaveImageOptions& /*options*/) {
  fail("an image");
}
StoredError stored_error(const Image& /*image*/, const SaveImageOptions& /*options*/,
                         std::span<const std::uint8_t> /*coverage*/) {
  fail("an image");
}
void save_mipmapped(const Image& /*image*/, const std::vector<Image>& /*mips*/,
                    const std::filesystem::path& path, const SaveImageOptions& /*options*/) {
  fail(path.string());
}

void save_layers(std::span<const ImageLayer> /*layers*/, const std::filesystem::path& path,
                 const SaveImageOptions& /*options*/) {
  fail(path.string());
}
std::vector<Material> load_materials(const Mesh& /*mesh*/, const std::filesystem::path& mesh_file,
                                     std::vector<Warning>* /*warnings*/, bool /*outside*/) {
  fail(mesh_file.string());
}
AssetPictures encode_maps(const AssetMaps& /*maps*/, const EncodeMapsOptions& /*options*/) {
  fail("an asset's pictures");
}
AssetPictures encode_maps(const AssetMaps& /*maps*/, ImageFormat /*format*/) {
  fail("an asset's pictures");
}
const Image** slot_of(AssetMaps& /*maps*/, std::string_view /*name*/) { return nullptr; }
std::vector<std::filesystem::path> save_asset(const Mesh& /*low*/,
                                              std::span<const AssetMaterial> /*materials*/,
                                              const std::filesystem::path& path,
                                              const SaveAssetOptions& /*options*/) {
  fail(path.string());
}
void save_glb(const Mesh& /*low*/, const AssetMaps& /*maps*/, const std::filesystem::path& path,
              const SaveGlbOptions& /*options*/) {
  fail(path.string());
}
Texture load_material_texture(const std::vector<Material>& /*materials*/, MaterialSlot /*slot*/,
                              std::vector<Warning>* /*warnings*/, std::uint32_t /*uv_set*/) {
  fail("a material's picture");
}
Texture load_material_texture(const std::vector<Material>& /*materials*/, MaterialSlot /*slot*/,
                              const Mesh& /*mesh*/, std::vector<Warning>* /*warnings*/,
                              NormalTextureFormat /*normals*/) {
  fail("a material's picture");
}
bool is_picture_file(const std::filesystem::path& path) { fail(path.string()); }
Texture load_texture(const std::filesystem::path& file, const Mesh* /*mesh*/,
                     std::vector<Warning>* /*warnings*/) {
  fail(file.string());
}

Texture load_material_texture(const std::vector<Material>& /*materials*/, MaterialSlot /*slot*/,
                              const Mesh& /*mesh*/, std::vector<Warning>* /*warnings*/) {
  fail("a material's picture");
}

void save_match(const Match& /*match*/, const std::filesystem::path& path) { fail(path.string()); }
Match load_match(const std::filesystem::path& path) { fail(path.string()); }
void save_clusters(const VisibilityClusters& /*clusters*/, const std::filesystem::path& path) {
  fail(path.string());
}

Volume load_volume(const std::filesystem::path& path, std::vector<Warning>* /*warnings*/) {
  fail(path.string());
}
Volume load_raw_volume(const std::filesystem::path& path, const RawVolumeLayout& /*layout*/,
                       std::vector<Warning>* /*warnings*/) {
  fail(path.string());
}
bool reads_openvdb() { return false; }
bool is_volume_name(const std::filesystem::path& /*path*/) { return false; }
void save_nrrd(const Volume& /*volume*/, const std::filesystem::path& path) { fail(path.string()); }

}  // namespace kiln
