// Materials of glTF.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <span>

#include "asset/gltf.h"
#include "asset/hierarchy.h"
#include "asset/materials.h"
#include "asset/udim_files.h"
#include "base/counted.h"
#include "io/file/text_scanner.h"
#include "io/image/picture.h"

namespace kiln {

std::vector<std::string> gltf_material_names(const GltfFile& file) {
  const GltfValue materials = file.list("materials");
  UniqueNames unique;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const std::string name = materials.at(i)["name"].text();
    names.push_back(unique.add(name.empty() ? "material" : name));
  }
  names.push_back(unique.add("default"));
  return names;
}

namespace {

#ifdef KILN_HAS_WEBP
constexpr bool kReadsWebp = true;
#else
constexpr bool kReadsWebp = false;
#endif

/// From glTF's UVs, whose origin is the upper left, to Kiln's: v = 1 - v', before and after.
std::array<float, 6> uv_transform_of(const GltfValue& transform) {
  const std::array<double, 2> offset = transform["offset"].numbers<2>({0, 0});
  const std::array<double, 2> scale = transform["scale"].numbers<2>({1, 1});
  const double angle = transform["rotation"].number(0);
  // Counter-clockwise as the picture is seen, that is with v down.
  const double a = std::cos(angle) * scale[0], b = std::sin(angle) * scale[1];
  const double c = -std::sin(angle) * scale[0], d = std::cos(angle) * scale[1];
  return {static_cast<float>(a),  static_cast<float>(-b), static_cast<float>(b + offset[0]),
          static_cast<float>(-c), static_cast<float>(d),  static_cast<float>(1 - d - offset[1])};
}

TextureWrap wrap_of(const GltfValue& sampler, const char* axis) {
  constexpr std::uint64_t kClamp = 33071, kMirror = 33648, kRepeat = 10497;
  const std::uint64_t wrap = sampler[axis].count(kRepeat);
  if (wrap == kClamp) return TextureWrap::clamp;
  if (wrap == kMirror) return TextureWrap::mirror;
  if (wrap != kRepeat) sampler[axis].fail("it is " + std::to_string(wrap) + ", which is no wrap");
  return TextureWrap::repeat;
}

const char* const kGlossiness = "KHR_materials_pbrSpecularGlossiness";

class MaterialReader {
 public:
  explicit MaterialReader(const GltfFile& file) : file_(file) {}

  Material read(const GltfValue& from) {
    Material material;
    material.multiplies = true;
    material.alpha_mode = AlphaMode::opaque;
    // A mesh without a material has no colour. glTF's default material is metal, which exporters of bare meshes do not
    // mean.
    if (!from.exists()) return material;
    material.color_from = material.roughness_from = material.metallic_from = MaterialNumber::given;
    material.place = file_.input().file + ": " + from.place();
    material.extras = from["extras"].dump();
    const GltfValue surface = from["pbrMetallicRoughness"];
    const GltfValue glossy = from["extensions"][kGlossiness];
    const bool is_glossy = glossy.exists() && !surface.exists();
    const std::array<double, 4> color =
        (is_glossy ? glossy["diffuseFactor"] : surface["baseColorFactor"]).numbers<4>({1, 1, 1, 1});
    for (std::size_t k = 0; k < 3; ++k) material.color[k] = static_cast<float>(color[k]);
    material.color_map =
        picture(is_glossy ? glossy["diffuseTexture"] : surface["baseColorTexture"]);
    if (is_glossy) {
      material.metallic_from = MaterialNumber::none;
      material.metallic = 0;
      material.roughness = static_cast<float>(1 - glossy["glossinessFactor"].number(1));
      material.roughness_map = picture(glossy["specularGlossinessTexture"]);
      material.roughness_map.channel = 3;
      material.roughness_map.inverted = true;
      ++glossy_;
    } else {
      material.metallic = static_cast<float>(surface["metallicFactor"].number(1));
      material.roughness = static_cast<float>(surface["roughnessFactor"].number(1));
      const MaterialPicture both = picture(surface["metallicRoughnessTexture"]);
      material.roughness_map = material.metallic_map = both;
      material.roughness_map.channel = 1;
      material.metallic_map.channel = 2;
    }
    read_opacity(from, color[3], material);
    const GltfValue normal = from["normalTexture"], occlusion = from["occlusionTexture"];
    material.normal_map = picture(normal);
    material.normal_scale = static_cast<float>(normal["scale"].number(1));
    material.occlusion_map = picture(occlusion);
    material.occlusion_map.channel = 0;
    material.occlusion_strength = static_cast<float>(occlusion["strength"].number(1));
    read_emission(from, material);
    for (const std::string& name : from["extensions"].names()) {
      if (name == kGlossiness || name == "KHR_materials_emissive_strength") continue;
      if (++left_[name] == 1 && first_left_.empty()) first_left_ = from.place();
    }
    material.double_sided = from["doubleSided"].flag();
    return material;
  }

  void warn() const {
    if (glossy_ != 0) {
      file_.input().warn("glossiness-converted",
                         counted(glossy_, "material") + " of " + kGlossiness +
                             ": diffuse was taken for colour, 1 - glossiness for roughness; the "
                             "specular colour is left out, so that metals come out dark.",
                         glossy_);
    }
    if (!left_.empty()) {
      std::uint64_t count = 0;
      std::string names;
      for (const auto& [name, times] : left_) {
        count += times;
        names += (names.empty() ? "" : ", ") + printable(name) + " (" + std::to_string(times) + ")";
      }
      file_.input().warn("material-extensions",
                         "its materials have looks that no map holds (" + first_left_ +
                             " for one), and these were left out: " + names + ".",
                         count);
    }
    if (nearest_ != 0) {
      file_.input().warn(
          "nearest-filter",
          counted(nearest_, "picture") + " of its materials (" + first_nearest_ +
              " for one) would show hard texels (magFilter NEAREST), but Kiln "
              "filters all linearly: enlarge them where maps are to have hard texels.",
          nearest_);
    }
    if (undecoded_ != 0) {
      file_.input().warn("picture-missing",
                         counted(undecoded_, "picture") + " of its materials cannot be read (" +
                             first_undecoded_ +
                             "); the factor stands alone. Export the file with "
                             "PNG or JPEG, or turn its pictures into BC7 (`ktx transcode`).",
                         undecoded_);
    }
    if (missing_ != 0) {
      file_.input().warn("picture-missing",
                         std::to_string(missing_) + " of its materials' pictures (" +
                             first_missing_ + " for one) are not there; the factor stands alone.",
                         missing_);
    }
  }

 private:
  static void read_opacity(const GltfValue& from, double factor, Material& material) {
    const std::string mode = from["alphaMode"].text();
    material.alpha_cutoff = static_cast<float>(from["alphaCutoff"].number(0.5));
    if (mode.empty() || mode == "OPAQUE") return;  // whatever the alpha is
    if (mode != "MASK" && mode != "BLEND")
      from["alphaMode"].fail("it is none of OPAQUE, MASK, BLEND");
    material.alpha_mode = mode == "MASK" ? AlphaMode::mask : AlphaMode::blend;
    material.opacity = static_cast<float>(factor);
    material.opacity_map = material.color_map;
    material.opacity_map.channel = 3;
  }

  void read_emission(const GltfValue& from, Material& material) {
    const GltfValue factor = from["emissiveFactor"];
    const double strength =
        from["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"].number(1);
    const std::array<double, 3> emission = factor.numbers<3>({0, 0, 0});
    for (std::size_t k = 0; k < 3; ++k) {
      material.emission[k] = static_cast<float>(emission[k] * strength);
    }
    if (factor.exists()) material.emission_from = MaterialNumber::given;
    // The default factor, 0, takes the picture away.
    if (emission != std::array<double, 3>{})
      material.emission_map = picture(from["emissiveTexture"]);
  }

  MaterialPicture picture(const GltfValue& texture_info) {
    MaterialPicture result;
    if (!texture_info.exists()) return result;
    const auto texture_index = texture_info["index"].index_into(file_.list("textures"));
    if (!texture_index) texture_info.fail("it names no texture");
    const GltfValue transform = texture_info["extensions"]["KHR_texture_transform"];
    result.uv_transform = uv_transform_of(transform);
    result.uv_set = static_cast<std::uint32_t>(std::min<std::uint64_t>(
        transform["texCoord"].count(texture_info["texCoord"].count(0)), 0xFFFFFFFFU));
    const GltfValue texture = file_.list("textures").at(*texture_index);
    if (const auto index = texture["sampler"].index_into(file_.list("samplers"))) {
      const GltfValue sampler = file_.list("samplers").at(*index);
      result.wrap = {wrap_of(sampler, "wrapS"), wrap_of(sampler, "wrapT")};
      constexpr std::uint64_t kNearest = 9728;
      if (sampler["magFilter"].count(0) == kNearest && nearest_++ == 0) {
        first_nearest_ = texture_info.place();
      }
    }
    const GltfValue webp = texture["extensions"]["EXT_texture_webp"]["source"];
    const bool takes_webp = webp.exists() && (kReadsWebp || !texture["source"].exists());
    // Pictures as GPUs take them are a loss beside the plain ones.
    const GltfValue basis = texture["extensions"]["KHR_texture_basisu"]["source"];
    const GltfValue dds = texture["extensions"]["MSFT_texture_dds"]["source"];
    const GltfValue source = takes_webp                   ? webp
                             : texture["source"].exists() ? texture["source"]
                             : basis.exists()             ? basis
                                                          : dds;
    const auto image_index = source.index_into(file_.list("images"));
    if (!image_index) {
      const std::vector<std::string> names = texture["extensions"].names();
      miss(texture, names.empty() ? "" : ", of " + names[0] + ", which Kiln does not read");
      return {};
    }
    const GltfValue image = file_.list("images").at(*image_index);
    const GltfValue uri = image["uri"];
    if (const auto known = pictures_.find(*image_index); known != pictures_.end()) {
      result.file = known->second.file;
      result.bytes = known->second.bytes;
      return result;
    }
    std::string bytes;
    if (uri.exists() && !GltfFile::decode_data_uri(uri, bytes)) {
      result.file = file_.path_of(uri);
      if (!is_picture_file(result.file)) {
        miss(uri);
        return {};
      }
    } else {
      const auto view = image["bufferView"].index_into(file_.list("bufferViews"));
      if (!uri.exists() && !view) image.fail("it has neither a URI nor a bufferView");
      // Images of one view share its bytes, and so are read once.
      Bytes own;
      Bytes& shared = uri.exists() ? own : views_[*view];
      if (shared == nullptr) {
        const std::string_view from = uri.exists() ? std::string_view(bytes) : file_.view(*view);
        const auto* const first = reinterpret_cast<const std::byte*>(from.data());
        shared = std::make_shared<const std::vector<std::byte>>(first, first + from.size());
      }
      result.bytes = shared;
      result.file = file_.input().file + ": " + image.place();
    }
    if (basis.exists() && !can_decode(result, texture)) result = {};
    pictures_.emplace(*image_index, result);
    return result;
  }

  /// True unless a picture is a KTX 2 file that cannot be read, such as Basis Universal, which is counted.
  bool can_decode(const MaterialPicture& picture, const GltfValue& texture) {
    std::string bytes;
    std::span<const std::byte> from;
    if (picture.bytes != nullptr) {
      from = *picture.bytes;
    } else {
      constexpr std::size_t kMost = 1024;  // of the header and what describes the format
      bytes.resize(kMost);
      std::ifstream file(picture.file, std::ios::binary);
      file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      bytes.resize(static_cast<std::size_t>(file.gcount()));
      from = std::as_bytes(std::span(bytes));
    }
    const std::string why = is_ktx2({reinterpret_cast<const char*>(from.data()), from.size()})
                                ? why_not_ktx2(from)
                                : "";
    if (why.empty()) return true;
    if (undecoded_++ == 0) first_undecoded_ = texture.place() + ": " + why;
    return false;
  }

  void miss(const GltfValue& what, const std::string& why = {}) {
    const std::string uri =
        what.place().ends_with("uri") ? " '" + what.text().substr(0, 200) + "'" : "";
    if (missing_++ == 0) first_missing_ = what.place() + uri + printable(why);
  }

  const GltfFile& file_;
  using Bytes = std::shared_ptr<const std::vector<std::byte>>;
  std::map<std::size_t, MaterialPicture> pictures_;  // by image
  std::map<std::size_t, Bytes> views_;               // of images
  std::uint64_t missing_ = 0, glossy_ = 0, nearest_ = 0, undecoded_ = 0;
  std::string first_missing_, first_left_, first_nearest_, first_undecoded_;
  std::map<std::string, std::uint64_t> left_;  // extensions, and how many materials have them
};

}  // namespace

std::vector<Material> read_gltf_materials(const GltfFile& file) {
  MaterialReader reader(file);
  std::vector<Material> materials;
  const std::vector<std::string> names = gltf_material_names(file);
  const GltfValue list = file.list("materials");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const GltfValue none(file.input(), nullptr, "");
    materials.push_back(reader.read(i < list.size() ? list.at(i) : none));
    materials.back().name = names[i];
  }
  reader.warn();
  return materials;
}

std::vector<Material> read_gltf_materials(const MeshInput& input) {
  return read_gltf_materials(GltfFile(input));
}

void note_vertex_opacity(const Mesh& mesh, std::vector<Material>& materials) {
  if (mesh.colors.empty()) return;
  constexpr std::uint8_t kOpaque = 255;
  for (std::size_t t = 0; t < mesh.materials.size(); ++t) {
    Material& material = materials[mesh.materials[t]];
    if (!material.multiplies || material.alpha_mode == AlphaMode::opaque) continue;
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (mesh.colors[v][3] != kOpaque) material.vertex_opacity = true;
    }
  }
}

}  // namespace kiln
