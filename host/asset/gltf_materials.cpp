// Reads the materials of glTF.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <span>

#include "asset/gltf.h"
#include "asset/gltf_draco.h"
#include "asset/hierarchy.h"
#include "asset/materials.h"
#include "asset/udim_files.h"
#include "base/counted.h"
#include "base/input_log.h"
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

/// The UV map that a KHR_texture_transform describes.
UvMap uv_map_of(const GltfValue& texture_info) {
  const GltfValue transform = texture_info["extensions"]["KHR_texture_transform"];
  const std::array<double, 2> offset = transform["offset"].numbers<2>({0, 0});
  const std::array<double, 2> scale = transform["scale"].numbers<2>({1, 1});
  const double angle = transform["rotation"].number(0);
  // As the picture is seen, with v pointing down, the rotation is counter-clockwise.
  return {{std::cos(angle) * scale[0], std::sin(angle) * scale[1], offset[0],
           -std::sin(angle) * scale[0], std::cos(angle) * scale[1], offset[1]}};
}

/// Converts an affine transform of glTF's UVs to the same transform of Kiln's UVs. The origin of glTF's UVs is the upper
/// left corner, so v is replaced by 1 - v before and after the transform.
std::array<float, 6> uv_transform_of(const UvMap& map) {
  const auto& [a, b, x, c, d, y] = map.m;
  return {static_cast<float>(a),  static_cast<float>(-b), static_cast<float>(b + x),
          static_cast<float>(-c), static_cast<float>(d),  static_cast<float>(1 - d - y)};
}

double determinant(const UvMap& map) { return map.m[0] * map.m[4] - map.m[1] * map.m[3]; }

/// Returns the map that first applies the inverse of `first`, then `map`.
/// \param first  must have a non-zero determinant
UvMap compose_after(const UvMap& map, const UvMap& first) {
  if (map == first) return {};
  const auto& [a, b, x, c, d, y] = first.m;
  const double size = determinant(first);
  const UvMap inverse{
      {d / size, -b / size, (b * y - d * x) / size, -c / size, a / size, (c * x - a * y) / size}};
  const auto& m = map.m;
  const auto& n = inverse.m;
  return {{m[0] * n[0] + m[1] * n[3], m[0] * n[1] + m[1] * n[4], m[0] * n[2] + m[1] * n[5] + m[2],
           m[3] * n[0] + m[4] * n[3], m[3] * n[1] + m[4] * n[4], m[3] * n[2] + m[4] * n[5] + m[5]}};
}

/// The UV set that a picture uses. The one in KHR_texture_transform takes precedence.
std::uint32_t uv_set_of(const GltfValue& texture_info) {
  const GltfValue transform = texture_info["extensions"]["KHR_texture_transform"];
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(
      transform["texCoord"].count(texture_info["texCoord"].count(0)), 0xFFFFFFFFU));
}

const char* const kGlossiness = "KHR_materials_pbrSpecularGlossiness";

/// The references to textures in all slots of a material.
std::vector<GltfValue> texture_infos(const GltfValue& material) {
  const GltfValue surface = material["pbrMetallicRoughness"];
  const GltfValue specular_glossiness = material["extensions"][kGlossiness];
  std::vector<GltfValue> texture_infos_of_slots;
  for (const GltfValue& info :
       {surface["baseColorTexture"], surface["metallicRoughnessTexture"],
        specular_glossiness["diffuseTexture"], specular_glossiness["specularGlossinessTexture"],
        material["normalTexture"], material["occlusionTexture"], material["emissiveTexture"]}) {
    if (info.exists()) texture_infos_of_slots.push_back(info);
  }
  return texture_infos_of_slots;
}

/// The UVs that the primitives of a material use in one set.
struct UsedUvs {
  bool are_integers = false;
  std::vector<std::size_t> accessors;
};

/// Chooses one of the transforms of a material's pictures: the one that turns quantised UVs into a
/// layout.
UvMap choose_map(const GltfFile& file, const std::vector<UvMap>& maps, const UsedUvs& used) {
  double min_uv[2] = {HUGE_VAL, HUGE_VAL}, max_uv[2] = {-HUGE_VAL, -HUGE_VAL};
  for (const std::size_t accessor : used.accessors) {
    const GltfNumbers uvs = file.numbers(accessor, 2);
    for (std::size_t i = 0; i < uvs.values.size(); ++i) {
      min_uv[i % 2] = std::min(min_uv[i % 2], uvs.values[i]);
      max_uv[i % 2] = std::max(max_uv[i % 2], uvs.values[i]);
    }
  }
  // Transforms whose result lies in the unit square come first, and among these the one with the
  // largest result. If there is none, the transform with the smallest result is chosen.
  const auto rank = [&](const UvMap& map) {
    constexpr double kUvTolerance = 1e-3;
    bool is_in_unit_square = true;
    for (const double u : {min_uv[0], max_uv[0]}) {
      for (const double v : {min_uv[1], max_uv[1]}) {
        for (const double coordinate : map.at(u, v)) {
          is_in_unit_square =
              is_in_unit_square && coordinate >= -kUvTolerance && coordinate <= 1 + kUvTolerance;
        }
      }
    }
    const double size = std::abs(determinant(map));
    return std::pair(is_in_unit_square ? 0 : 1, is_in_unit_square ? -size : size);
  };
  return *std::min_element(maps.begin(), maps.end(),
                           [&](const UvMap& a, const UvMap& b) { return rank(a) < rank(b); });
}

TextureWrap wrap_of(const GltfValue& sampler, const char* axis) {
  constexpr std::uint64_t kClampToEdge = 33071, kMirroredRepeat = 33648, kRepeat = 10497;
  const std::uint64_t wrap = sampler[axis].count(kRepeat);
  if (wrap == kClampToEdge) return TextureWrap::clamp;
  if (wrap == kMirroredRepeat) return TextureWrap::mirror;
  if (wrap != kRepeat)
    sampler[axis].fail("it is " + std::to_string(wrap) + ", which is not a wrap mode of glTF");
  return TextureWrap::repeat;
}

class MaterialReader {
 public:
  MaterialReader(const GltfFile& file, std::uint32_t uv_set) : file_(file), uv_set_(uv_set) {}

  /// Reads a material.
  /// \param uv_map  transform that is applied to the UVs of the mesh, if any
  Material read(const GltfValue& from, const std::optional<UvMap>& uv_map) {
    Material material;
    uv_map_ = uv_map;
    material.multiplies = true;
    material.alpha_mode = AlphaMode::opaque;
    // A mesh without a material gets no colour. The default material of glTF would be metallic,
    // which is not what exporters of plain meshes mean.
    if (!from.exists()) return material;
    material.color_from = material.roughness_from = material.metallic_from = MaterialNumber::given;
    material.place = file_.input().file + ": " + from.place();
    material.extras = from["extras"].dump();
    const GltfValue surface = from["pbrMetallicRoughness"];
    const GltfValue specular_glossiness = from["extensions"][kGlossiness];
    const bool is_glossy = specular_glossiness.exists() && !surface.exists();
    const std::array<double, 4> color =
        (is_glossy ? specular_glossiness["diffuseFactor"] : surface["baseColorFactor"])
            .numbers<4>({1, 1, 1, 1});
    for (std::size_t k = 0; k < 3; ++k) material.color[k] = static_cast<float>(color[k]);
    material.color_map =
        picture(is_glossy ? specular_glossiness["diffuseTexture"] : surface["baseColorTexture"]);
    if (is_glossy) {
      material.metallic_from = MaterialNumber::none;
      material.metallic = 0;
      material.roughness =
          static_cast<float>(1 - specular_glossiness["glossinessFactor"].number(1));
      material.roughness_map = picture(specular_glossiness["specularGlossinessTexture"]);
      material.roughness_map.channel = 3;
      material.roughness_map.inverted = true;
      ++glossy_materials_;
    } else {
      material.metallic = static_cast<float>(surface["metallicFactor"].number(1));
      material.roughness = static_cast<float>(surface["roughnessFactor"].number(1));
      const MaterialPicture metallic_roughness = picture(surface["metallicRoughnessTexture"]);
      material.roughness_map = material.metallic_map = metallic_roughness;
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
      if (++ignored_extensions_[name] == 1 && first_ignored_extension_.empty())
        first_ignored_extension_ = from.place();
    }
    material.double_sided = from["doubleSided"].flag();
    return material;
  }

  void warn() const {
    if (glossy_materials_ != 0) {
      file_.input().warn(
          "glossiness-converted",
          counted(glossy_materials_, "material") + " of " + kGlossiness +
              ": converted to colour = diffuse, roughness = 1 - glossiness. The specular "
              "colour is ignored, so metals look too dark.",
          glossy_materials_);
    }
    if (!ignored_extensions_.empty()) {
      std::uint64_t count = 0;
      std::string names;
      for (const auto& [name, times] : ignored_extensions_) {
        count += times;
        names += (names.empty() ? "" : ", ") + printable(name) + " (" + std::to_string(times) + ")";
      }
      file_.input().warn("material-extensions",
                         "its materials (" + first_ignored_extension_ +
                             " for one) use extensions that no map of Kiln represents, and which "
                             "were ignored: " +
                             names + ".",
                         count);
    }
    if (nearest_filtered_ != 0) {
      file_.input().warn(
          "nearest-filter",
          counted(nearest_filtered_, "picture") + " of its materials (" + first_nearest_ +
              " for one) with nearest filtering (magFilter NEAREST), but Kiln filters "
              "linearly: enlarge them to keep hard texels.",
          nearest_filtered_);
    }
    if (undecoded_pictures_ != 0) {
      file_.input().warn("picture-missing",
                         counted(undecoded_pictures_, "picture") +
                             " of its materials cannot be read (" + first_undecoded_ +
                             "); only the material's factor is used. Export the file with "
                             "PNG or JPEG, or convert its pictures to BC7 (`ktx transcode`).",
                         undecoded_pictures_);
    }
    if (missing_picture_count_ != 0) {
      file_.input().warn("picture-missing",
                         std::to_string(missing_picture_count_) + " of its materials' pictures (" +
                             first_missing_ +
                             " for one) are missing; only the material's factor is used.",
                         missing_picture_count_);
    }
    if (unread_pictures_ != 0) {
      file_.input().warn("picture-missing",
                         counted(unread_pictures_, "picture") + " of its materials (" +
                             first_unread_ + (unread_pictures_ == 1 ? ") is" : " for one) are") +
                             " in a format of an extension that Kiln does not read; only the "
                             "material's factor is used. Export the file with PNG or JPEG.",
                         unread_pictures_);
    }
  }

 private:
  static void read_opacity(const GltfValue& from, double factor, Material& material) {
    const std::string mode = from["alphaMode"].text();
    material.alpha_cutoff = static_cast<float>(from["alphaCutoff"].number(0.5));
    if (mode.empty() || mode == "OPAQUE") return;  // alpha of an opaque material is ignored
    if (mode != "MASK" && mode != "BLEND")
      from["alphaMode"].fail("it is not OPAQUE, MASK or BLEND");
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
    // With the default factor of 0, the emission picture has no effect.
    if (emission != std::array<double, 3>{})
      material.emission_map = picture(from["emissiveTexture"]);
  }

  MaterialPicture picture(const GltfValue& texture_info) {
    MaterialPicture result;
    if (!texture_info.exists()) return result;
    const auto texture_index = texture_info["index"].index_into(file_.list("textures"));
    if (!texture_index) texture_info.fail("it refers to no texture");
    result.uv_set = uv_set_of(texture_info);
    const UvMap map = uv_map_of(texture_info);
    result.uv_transform =
        uv_transform_of(uv_map_ && result.uv_set == uv_set_ ? compose_after(map, *uv_map_) : map);
    const GltfValue texture = file_.list("textures").at(*texture_index);
    if (const auto index = texture["sampler"].index_into(file_.list("samplers"))) {
      const GltfValue sampler = file_.list("samplers").at(*index);
      result.wrap = {wrap_of(sampler, "wrapS"), wrap_of(sampler, "wrapT")};
      constexpr std::uint64_t kNearestFilter = 9728;
      if (sampler["magFilter"].count(0) == kNearestFilter && nearest_filtered_++ == 0) {
        first_nearest_ = texture_info.place();
      }
    }
    const GltfValue webp = texture["extensions"]["EXT_texture_webp"]["source"];
    const bool uses_webp = webp.exists() && (kReadsWebp || !texture["source"].exists());
    // A picture without GPU compression has a higher quality, so it is preferred if both exist.
    const GltfValue basis = texture["extensions"]["KHR_texture_basisu"]["source"];
    const GltfValue dds = texture["extensions"]["MSFT_texture_dds"]["source"];
    const GltfValue source = uses_webp                    ? webp
                             : texture["source"].exists() ? texture["source"]
                             : basis.exists()             ? basis
                                                          : dds;
    const auto image_index = source.index_into(file_.list("images"));
    if (!image_index) {
      const std::vector<std::string> names = texture["extensions"].names();
      if (names.empty()) {
        count_missing_picture(texture);
      } else if (unread_pictures_++ == 0) {
        first_unread_ = texture.place() + ": " + printable(names[0]);
      }
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
        count_missing_picture(uri);
        return {};
      }
    } else {
      const auto view = image["bufferView"].index_into(file_.list("bufferViews"));
      if (!uri.exists() && !view) image.fail("it has neither a URI nor a bufferView");
      // Images that refer to the same view share its bytes, so that the view is read once.
      CachedBytes image_bytes;
      CachedBytes& shared = uri.exists() ? image_bytes : views_[*view];
      if (shared == nullptr) {
        const std::string_view encoded = uri.exists() ? std::string_view(bytes) : file_.view(*view);
        const auto* const first = reinterpret_cast<const std::byte*>(encoded.data());
        shared = std::make_shared<const std::vector<std::byte>>(first, first + encoded.size());
      }
      result.bytes = shared;
      result.file = file_.input().file + ": " + image.place();
    }
    if (basis.exists() && !can_decode(result, texture)) result = {};
    pictures_.emplace(*image_index, result);
    return result;
  }

  /// False for a KTX 2 file that Kiln cannot decode, such as Basis Universal. These files are
  /// counted for a warning.
  bool can_decode(const MaterialPicture& picture, const GltfValue& texture) {
    std::string bytes;
    std::span<const std::byte> encoded;
    if (picture.bytes != nullptr) {
      encoded = *picture.bytes;
    } else {
      // The first bytes of a file, which contain the header and the description of the format
      constexpr std::size_t kKtxHeaderBytes = 1024;
      bytes.resize(kKtxHeaderBytes);
      register_file_check(picture.file);
      std::ifstream file(picture.file, std::ios::binary);
      file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      bytes.resize(static_cast<std::size_t>(file.gcount()));
      encoded = std::as_bytes(std::span(bytes));
    }
    const std::string reason =
        is_ktx2({reinterpret_cast<const char*>(encoded.data()), encoded.size()})
            ? explain_unreadable_ktx2(encoded)
            : "";
    if (reason.empty()) return true;
    if (undecoded_pictures_++ == 0) first_undecoded_ = texture.place() + ": " + reason;
    return false;
  }

  void count_missing_picture(const GltfValue& what) {
    const std::string uri =
        what.place().ends_with("uri") ? " '" + what.text().substr(0, 200) + "'" : "";
    if (missing_picture_count_++ == 0) first_missing_ = what.place() + printable(uri);
  }

  const GltfFile& file_;
  using CachedBytes = std::shared_ptr<const std::vector<std::byte>>;
  // Pictures that were read, by the index of their image
  std::map<std::size_t, MaterialPicture> pictures_;
  // Bytes that were read, by the index of their image
  std::map<std::size_t, CachedBytes> views_;
  std::uint64_t missing_picture_count_ = 0, glossy_materials_ = 0, nearest_filtered_ = 0,
                unread_pictures_ = 0, undecoded_pictures_ = 0;
  std::uint32_t uv_set_;
  std::optional<UvMap> uv_map_;  // UV map of the current material
  std::string first_missing_, first_unread_, first_ignored_extension_, first_nearest_,
      first_undecoded_;
  // Number of materials that use each ignored extension
  std::map<std::string, std::uint64_t> ignored_extensions_;
};

}  // namespace

std::set<std::uint32_t> gltf_uv_sets(const GltfFile& file) {
  const GltfValue materials = file.list("materials");
  std::set<std::uint32_t> sets;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    for (const GltfValue& info : texture_infos(materials.at(i))) sets.insert(uv_set_of(info));
  }
  return sets;
}

std::vector<std::optional<UvMap>> gltf_uv_maps(const GltfFile& file, std::uint32_t uv_set,
                                               bool warns) {
  const GltfValue materials = file.list("materials"), meshes = file.list("meshes");
  std::vector<UsedUvs> uvs_of_material(materials.size());
  const std::string name = "TEXCOORD_" + std::to_string(uv_set);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const GltfValue primitives = meshes.at(i)["primitives"];
    for (std::size_t k = 0; k < primitives.size(); ++k) {
      const GltfValue primitive = primitives.at(k);
      const auto material = primitive["material"].index_into(materials);
      const auto accessor = primitive["attributes"][name].index_into(file.list("accessors"));
      if (!material || !accessor) continue;
      UsedUvs& material_uvs = uvs_of_material[*material];
      material_uvs.are_integers = material_uvs.are_integers || file.holds_integers(*accessor);
      if (!primitive["extensions"][kDraco].exists()) {
        material_uvs.accessors.push_back(*accessor);
      }
    }
  }
  std::vector<std::optional<UvMap>> result(materials.size());
  std::uint64_t materials_with_several_maps = 0;
  std::string first;
  for (std::size_t i = 0; i < uvs_of_material.size(); ++i) {
    if (!uvs_of_material[i].are_integers) continue;
    std::vector<UvMap> maps;  // The UV transforms, each once
    for (const GltfValue& info : texture_infos(materials.at(i))) {
      const UvMap map = uv_map_of(info);
      if (uv_set_of(info) != uv_set || determinant(map) == 0) continue;
      if (std::find(maps.begin(), maps.end(), map) == maps.end()) maps.push_back(map);
    }
    if (maps.empty()) continue;
    const UvMap chosen = maps.size() == 1 ? maps[0] : choose_map(file, maps, uvs_of_material[i]);
    if (maps.size() > 1 && materials_with_several_maps++ == 0) first = materials.at(i).place();
    if (chosen != UvMap()) result[i] = chosen;
  }
  if (materials_with_several_maps != 0 && warns) {
    file.input().warn(
        "uv-transforms",
        "pictures of " + counted(materials_with_several_maps, "material") + " (" + first +
            " for one) scale the mesh's quantised UVs by different amounts: its layout is the one "
            "that fills most of the unit square.",
        materials_with_several_maps);
  }
  return result;
}

std::vector<Material> read_gltf_materials(const GltfFile& file, std::uint32_t uv_set) {
  MaterialReader reader(file, uv_set);
  std::vector<Material> materials;
  const std::vector<std::string> names = gltf_material_names(file);
  const std::vector<std::optional<UvMap>> uv_maps = gltf_uv_maps(file, uv_set, false);
  const GltfValue list = file.list("materials");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const GltfValue missing_value(file.input(), nullptr, "");
    const bool exists = i < list.size();
    materials.push_back(
        reader.read(exists ? list.at(i) : missing_value, exists ? uv_maps[i] : std::nullopt));
    materials.back().name = names[i];
  }
  reader.warn();
  return materials;
}

std::vector<Material> read_gltf_materials(const MeshInput& input) {
  return read_gltf_materials(GltfFile(input), input.options.uv_set);
}

void set_vertex_opacity(const Mesh& mesh, std::vector<Material>& materials) {
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
