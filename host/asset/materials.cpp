// Reads the materials of all formats, and their pictures as textures.
#include "asset/materials.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "asset/assimp.h"
#include "asset/fbx.h"
#include "asset/gltf.h"
#include "asset/udim_files.h"
#include "base/counted.h"
#include "base/formatted.h"
#include "base/input_log.h"
#include "base/srgb.h"
#include "image/grey.h"
#include "image/normal_channels.h"
#include "io/file/bounds.h"
#include "io/file/byte_source.h"
#include "io/file/text_scanner.h"
#include "io/image/image_reader.h"
#include "kiln/image.h"
#include "kiln/material.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// Describes a slot: the members of Material that it uses, and its names.
struct SlotRow {
  MaterialPicture Material::*picture;
  /// Member of Material that holds the source of the number; null if the source is always
  /// `fixed_source`
  MaterialNumber Material::*number;
  /// Source of the slot's number, for slots whose source is not a member of Material: normals have
  /// no number; opacity and occlusion default to 1 in all formats
  MaterialNumber fixed_source;
  const char* name;
  const char* statements;  ///< MTL statements that set the slot, for messages
};
const SlotRow& row_of(MaterialSlot slot) {
  constexpr MaterialNumber kNoNumber = MaterialNumber::none,
                           kMaterialNumber = MaterialNumber::given;
  using M = Material;
  static const SlotRow rows[] = {
      {&M::color_map, &M::color_from, kNoNumber, "colour", "map_Kd or Kd"},
      {&M::opacity_map, nullptr, kMaterialNumber, "opacity", "map_d or d"},
      {&M::normal_map, nullptr, kNoNumber, "normals", "norm, map_Kn, map_Bump or bump"},
      {&M::roughness_map, &M::roughness_from, kNoNumber, "roughness", "map_Pr, Pr or Ns"},
      {&M::metallic_map, &M::metallic_from, kNoNumber, "metalness", "map_Pm or Pm"},
      {&M::emission_map, &M::emission_from, kNoNumber, "emission", "map_Ke or Ke"},
      {&M::occlusion_map, nullptr, kMaterialNumber, "occlusion", "none"},
  };
  return rows[static_cast<std::size_t>(slot)];
}

const MaterialPicture& picture_of(const Material& material, MaterialSlot slot) {
  return material.*row_of(slot).picture;
}

/// The value of a slot that has no picture.
std::array<float, 4> default_value_of(const Material& material, MaterialSlot slot) {
  const auto equal_channels = [](float value) {
    return std::array<float, 4>{value, value, value, value};
  };
  const auto& [red, green, blue] = material.color;
  switch (slot) {
    case MaterialSlot::color:
      return {red, green, blue, material.opacity};
    case MaterialSlot::opacity:
      return equal_channels(material.opacity);
    case MaterialSlot::normal:
      return {0, 0, 1, 1};
    case MaterialSlot::roughness:
      return equal_channels(material.roughness);
    case MaterialSlot::metallic:
      return equal_channels(material.metallic);
    case MaterialSlot::emission:
      return {material.emission[0], material.emission[1], material.emission[2], 1};
    case MaterialSlot::occlusion:
      return equal_channels(1);
  }
  return {};
}

MaterialNumber number_source(const Material& material, MaterialSlot slot) {
  const SlotRow& row = row_of(slot);
  return row.number == nullptr ? row.fixed_source : material.*row.number;
}

/// A material in messages: its name, and the file and line that define it.
std::string describe_material(const Material& material) {
  return "\"" + printable(material.name) + "\" (" +
         (material.place.empty() ? "defined in no file" : material.place) + ")";
}

/// Collects the materials that have the same problem, for a single warning.
class MaterialFinding {
 public:
  void add(const Material& material) {
    if (count_++ == 0) first_ = &material;
  }
  std::uint64_t count() const { return count_; }
  const Material& first() const { return *first_; }
  /// Adds the warning, if any materials were collected.
  /// \param text  follows the materials, which are named like '3 materials, "M" (a.mtl: line 1)
  ///   first, '
  void warn(std::vector<Warning>* warnings, const char* code, const std::string& text) const {
    if (count_ == 0 || warnings == nullptr) return;
    warnings->push_back({code,
                         counted(count_, "material") + ", " + describe_material(*first_) +
                             (count_ > 1 ? " first, " : ", ") + text,
                         count_});
  }

 private:
  const Material* first_ = nullptr;
  std::uint64_t count_ = 0;
};

/// Rejects slots that no material describes. Warns of values that were converted from an older
/// convention, such as roughness from `Ns`.
void check_values(const std::vector<Material>& materials, MaterialSlot slot,
                  std::vector<Warning>* warnings) {
  MaterialFinding without_value, converted;
  for (const Material& material : materials) {
    if (!picture_of(material, slot).empty()) continue;
    const MaterialNumber number = number_source(material, slot);
    if (number == MaterialNumber::none) without_value.add(material);
    if (number == MaterialNumber::converted) converted.add(material);
  }
  const SlotRow& words = row_of(slot);
  const std::string slot_text = std::string(words.name) + " (" + words.statements + ")";
  if (without_value.count() == materials.size()) {
    Message ignored;  // Receives the name of the missing picture
    if (warnings != nullptr) {
      for (const Warning& warning : *warnings) {
        if (warning.code == "ignored-pictures") ignored += " (" + warning.message + ")";
      }
    }
    throw Error(ErrorCode::input,
                "No material of the high poly has " + slot_text + ": " +
                    describe_material(without_value.first()) +
                    (without_value.count() > 1 ? " is the first without one" : " has none") +
                    ". Add it to the material, or give a texture file." + ignored);
  }
  // A material without a normal map has no normal detail, as intended, so there is no warning.
  if (slot != MaterialSlot::normal) {
    const float default_value = default_value_of({}, slot)[0];
    without_value.warn(
        warnings, "material-value",
        "without " + slot_text + ": it is " + (default_value == 0 ? "0" : "1") + " there.");
  }
  if (converted.count() == 0) return;
  const std::string value =
      formatted(" (here %.4g).", double{default_value_of(converted.first(), slot)[0]});
  if (slot == MaterialSlot::roughness) {
    converted.warn(warnings, "roughness-from-ns",
                   "without map_Pr and Pr: the roughness is 1 - sqrt(Ns / 1000), as Blender writes "
                   "Ns" +
                       value);
  } else {
    converted.warn(
        warnings, "metallic-from-illum",
        "without map_Pm and Pm: the metalness is Ka where illum is 3 or 6, or else 0, as "
        "Blender writes it" +
            value);
  }
}

/// True if a slot has a single number per point, so that a transfer bakes one channel.
bool holds_number(MaterialSlot slot) {
  return slot == MaterialSlot::roughness || slot == MaterialSlot::metallic ||
         slot == MaterialSlot::occlusion;
}

/// True if the opacity of a material outside of glTF is the alpha channel of its colour picture, since
/// it has no picture of opacity, or that one.
bool reads_color_alpha(const Material& material) {
  return !material.multiplies &&
         (material.opacity_map.empty() || material.opacity_map.file == material.color_map.file);
}

/// The picture that a slot reads.
const MaterialPicture& source_picture(const Material& material, MaterialSlot slot) {
  return slot == MaterialSlot::opacity && reads_color_alpha(material) ? material.color_map
                                                                      : picture_of(material, slot);
}

/// Index of the picture's channel that a slot uses; -1: all channels.
/// \param in_alpha     true: the texture consists of the alpha channel already
/// \param among_gltf   true: some materials come from glTF, where a map is one channel of a picture
int channel_of(const Material& material, MaterialSlot slot, const MaterialPicture& picture,
               bool in_alpha, bool among_gltf) {
  if (slot == MaterialSlot::color || slot == MaterialSlot::normal ||
      slot == MaterialSlot::emission) {
    return -1;
  }
  const bool uses_alpha =
      slot == MaterialSlot::opacity && !in_alpha && picture.channel < 0 &&
      (reads_color_alpha(material) || (among_gltf && picture.file == material.color_map.file));
  return uses_alpha ? 3 : picture.channel;
}

/// The factor of a picture. For colours it applies to linear light, for normals to x and y.
Texture::Factor factor_of(const Material& material, MaterialSlot slot,
                          const MaterialPicture& picture) {
  Texture::Factor factor;
  if (!material.multiplies) {
    // MTL and FBX may name a picture of colours and state a number for opacity, as of tinted glass: the picture's alpha
    // does not replace the number. A picture of opacity replaces it, as in Blender.
    if (slot == MaterialSlot::opacity && material.opacity_map.empty()) {
      factor.times = default_value_of(material, slot);
    }
    return factor;
  }
  factor.times = default_value_of(material, slot);
  factor.times[3] = 1;  // Alpha is not multiplied here, since opacity is a slot of its own
  if (slot == MaterialSlot::normal) {
    factor.times = {material.normal_scale, material.normal_scale, 1, 1};
  }
  if (slot == MaterialSlot::occlusion) {
    const float strength = material.occlusion_strength;
    factor.times = {strength, strength, strength, 1};
    factor.plus = 1 - strength;
  }
  if (picture.inverted) {  // Roughness is 1 - (glossiness of the picture) * factor
    for (std::size_t k = 0; k < 3; ++k) factor.times[k] -= 1;
    factor.plus = 1;
  }
  return factor;
}

/// Makes a picture from one channel of another. In a grey picture, channels 0 to 2 are the same.
std::shared_ptr<const Image> extract_channel(const Image& image, std::uint32_t channel) {
  auto result = std::make_shared<Image>();
  result->width = image.width;
  result->height = image.height;
  result->channels = 1;
  result->pixels.resize(std::size_t{image.width} * image.height);
  const bool has_alpha = image.channels % 2 == 0;
  const std::uint32_t colors = image.channels - (has_alpha ? 1 : 0);
  for (std::size_t i = 0; i < result->pixels.size(); ++i) {
    const float* const read = &image.pixels[i * image.channels];
    result->pixels[i] =
        channel == 3 ? (has_alpha ? read[colors] : 1) : read[std::min(channel, colors - 1)];
  }
  return result;
}

/// The UV sets of a mesh: its own, with which it was read, and the others.
struct KnownSets {
  std::uint32_t own_set = 0;
  std::span<const UvSet> others;

  bool has(std::uint32_t set) const {
    return set == own_set || std::any_of(others.begin(), others.end(),
                                         [set](const UvSet& other) { return other.set == set; });
  }
};

[[noreturn]] void fail_for_missing_uv_set(const Material& material, MaterialSlot slot,
                                          std::uint32_t needed, std::uint32_t given) {
  throw Error(ErrorCode::input,
              describe_material(material) + ": its picture of " + row_of(slot).name +
                  " uses UV set " + std::to_string(needed) + ", but the mesh was read with set " +
                  std::to_string(given) +
                  " and does not have that set. Read the mesh with that set (`uv-set`), export the "
                  "file with a single UV set, or give a texture file.");
}

/// With a factor above a million, floats could not distinguish the texels of the picture, and the
/// colours would be noise.
void check_transform(const Material& material, const std::array<float, 6>& transform) {
  constexpr float kMaxUvOffset = 1e6F;
  if (std::all_of(transform.begin(), transform.end(),
                  [](float value) { return std::abs(value) <= kMaxUvOffset; })) {
    return;
  }
  throw Error(ErrorCode::input, describe_material(material) +
                                    ": its picture is moved or scaled by more than a million in "
                                    "UV space. Export the file again.");
}

/// For pairs of files that were compared: true if their bytes are equal.
using ComparedFiles = std::map<std::pair<fs::path, fs::path>, bool>;

/// True if two pictures are the same file, or equal copies of it.
bool are_equivalent(const MaterialPicture& a, const MaterialPicture& b,
                    ComparedFiles& compared_files) {
  if (a.empty() || b.empty()) return a.empty() && b.empty();
  if (a.channel != b.channel || a.uv_set != b.uv_set || a.uv_transform != b.uv_transform ||
      a.wrap != b.wrap || a.inverted != b.inverted) {
    return false;
  }
  if (a.bytes != nullptr && b.bytes != nullptr) return a.bytes == b.bytes || *a.bytes == *b.bytes;
  if (a.file == b.file) return true;
  const auto [known, added] = compared_files.try_emplace({a.file, b.file});
  if (!added) return known->second;
  std::error_code error;
  register_file_check(a.file);
  register_file_check(b.file);
  if (fs::equivalent(a.file, b.file, error)) return known->second = true;
  std::ifstream one(a.file, std::ios::binary), other(b.file, std::ios::binary);
  using Byte = std::istreambuf_iterator<char>;
  return known->second = one && other && std::equal(Byte(one), Byte(), Byte(other), Byte());
}

/// True if two materials look the same.
bool are_equivalent(const Material& a, const Material& b, ComparedFiles& compared_files) {
  for (const MaterialSlot slot :
       {MaterialSlot::color, MaterialSlot::opacity, MaterialSlot::normal, MaterialSlot::roughness,
        MaterialSlot::metallic, MaterialSlot::emission, MaterialSlot::occlusion}) {
    if (!are_equivalent(picture_of(a, slot), picture_of(b, slot), compared_files)) return false;
  }
  return a.color == b.color && a.opacity == b.opacity && a.roughness == b.roughness &&
         a.metallic == b.metallic && a.emission == b.emission &&
         a.occlusion_strength == b.occlusion_strength;
}

/// Reads the first bytes of a PLY, which contain its header. A scan may have gigabytes after it.
std::string ply_head(const ByteSource& source) {
  constexpr std::size_t kFirstReadBytes = std::size_t{1} << 16, kLineEnd = 2;
  constexpr std::string_view kHeaderEnd = "end_header";
  for (std::size_t limit = kFirstReadBytes;; limit *= 4) {
    std::string head = source.head(limit);
    const std::size_t end = head.find(kHeaderEnd);
    const bool is_whole =
        end != std::string::npos && end + kHeaderEnd.size() + kLineEnd <= head.size();
    if (is_whole || head.size() < limit) return head;
  }
}

}  // namespace

namespace {

/// Removes material files that do not exist, with a warning, if another one exists; this is what
/// programs that read OBJ do.
void drop_missing_libraries(std::vector<fs::path>& paths, const fs::path& mesh_file,
                            std::vector<Warning>* warnings) {
  std::vector<fs::path> existing, missing;
  for (const fs::path& path : paths) {
    std::error_code error;
    (fs::exists(path, error) ? existing : missing).push_back(path);
  }
  if (existing.empty() || missing.empty()) return;
  paths = existing;
  if (warnings == nullptr) return;
  const auto name_of = [&](const fs::path& path) {
    return path.lexically_proximate(mesh_file.parent_path()).string();
  };
  const std::string others_text =
      missing.size() == 1 ? "" : " and " + std::to_string(missing.size() - 1) + " more";
  warnings->push_back({"mtl-missing",
                       mesh_file.string() + " refers to the material file '" + name_of(missing[0]) +
                           "'" + others_text + ", which does not exist: '" + name_of(existing[0]) +
                           "' is used instead. Add the missing file, or remove its line.",
                       missing.size()});
}

}  // namespace

std::vector<Material> load_materials(const Mesh& mesh, const fs::path& mesh_file,
                                     std::vector<Warning>* warnings, bool outside) {
  std::vector<Material> read;
  FileFinder finder(mesh_file.parent_path(), warnings);
  std::vector<fs::path> paths = material_file_paths(mesh, mesh_file.parent_path());
  if (paths.empty() && has_own_materials(mesh_file)) paths.push_back(mesh_file);
  for (fs::path& path : paths) path = finder.find(path, mesh_file.string());
  drop_missing_libraries(paths, mesh_file, warnings);
  for (const fs::path& path : paths) {
    MeshInput input{path.string(), {}, warnings};
    const FailWith fail = [&](const std::string& place, const std::string& problem,
                              const Message& remedy) {
      MeshInput named = input;
      named.file += " (materials of " + mesh_file.string() + ")";
      named.fail(place, problem, remedy);
    };
    const auto source = open_file(path, fail);
    const std::string bytes = is_ply_name(path) ? ply_head(*source) : read_whole(*source, fail);
    input.bytes = bytes;
    input.folder = path.parent_path();
    input.options.outside = outside;
    input.options.uv_set = mesh.uv_set;
    if (is_fbx_name(path) || is_assimp_name(path))
      input.warnings = nullptr;  // load_mesh() has reported these warnings already
    for (Material& material :
         is_gltf_name(path)     ? read_gltf_materials(input)
         : is_ply_name(path)    ? read_ply_materials(input, path.parent_path(), &finder)
         : is_fbx_name(path)    ? read_fbx(input).materials
         : is_assimp_name(path) ? read_by_assimp(input).materials
                                : read_materials(input, path.parent_path(), &finder)) {
      read.push_back(std::move(material));
    }
  }
  // For each name, the first material that has it
  std::map<std::string_view, const Material*> by_name;
  MaterialFinding differing_materials;
  std::string other;
  ComparedFiles compared_files;
  const std::unordered_set<std::string_view> used_names(mesh.material_names.begin(),
                                                        mesh.material_names.end());
  for (const Material& material : read) {
    const auto [entry, added] = by_name.emplace(material.name, &material);
    if (added || !used_names.contains(material.name)) continue;
    if (are_equivalent(*entry->second, material, compared_files)) continue;
    if (differing_materials.count() == 0) other = material.place;
    differing_materials.add(*entry->second);
  }
  differing_materials.warn(warnings, "materials-differ",
                           "with another definition in " + other +
                               ": the first definition is used. If both are needed, rename one.");
  std::vector<Material> materials;
  std::uint64_t missing = 0;
  std::string example;
  for (const std::string& name : mesh.material_names) {
    if (const auto found = by_name.find(name); found != by_name.end()) {
      materials.push_back(*found->second);
      continue;
    }
    materials.emplace_back().name = name;
    if (missing++ == 0) example = name;
  }
  if (missing != 0 && warnings != nullptr) {
    warnings->push_back({"material-missing",
                         "'" + mesh_file.string() + "': " + std::to_string(missing) +
                             " of its materials (\"" + printable(example) +
                             "\" for one) are described in no file.",
                         missing});
  }
  set_vertex_opacity(mesh, materials);
  return materials;
}

std::vector<Material> materials_by_name(const std::vector<Material>& materials,
                                        const std::vector<std::string>& names) {
  std::unordered_map<std::string_view, const Material*> first_of_name;
  for (const Material& material : materials) first_of_name.try_emplace(material.name, &material);
  std::vector<Material> result;
  for (const std::string& name : names) {
    if (const auto found = first_of_name.find(name); found != first_of_name.end()) {
      result.push_back(*found->second);
    } else {
      result.emplace_back().name = name;
    }
  }
  return result;
}

namespace {

/// True if the alpha channel of a material's colour picture is its opacity, so that it weights the
/// colours.
bool is_alpha_opacity(const Material& material) {
  const MaterialPicture &color = material.color_map, &opacity = material.opacity_map;
  // The alpha of an opaque material is ignored
  if (material.alpha_mode == AlphaMode::opaque) return false;
  if (opacity.empty()) return !material.multiplies;
  return opacity.file == color.file && opacity.bytes == color.bytes &&
         opacity.uv_transform == color.uv_transform;
}

/// The pictures of a texture. Each is read once, even if several materials or paths refer to it.
class Pictures {
 public:
  /// \param kind  kind of the texture; pictures in linear light are converted if it is sRGB
  explicit Pictures(TextureKind kind) : kind_(kind) {}

  std::shared_ptr<const Image> read(const MaterialPicture& picture, const fs::path& file) {
    std::error_code error;
    const Key key(picture.bytes.get(),
                  picture.bytes ? fs::path() : fs::weakly_canonical(file, error));
    const auto [entry, added] = pictures_read_.try_emplace(key);
    if (added) {
      entry->second = std::make_shared<const Image>(read_image(picture, file));
    }
    return entry->second;
  }

  /// True if a picture of colours is a GPU texture of two channels, such as BC5.
  bool lacks_color(const MaterialPicture& picture, const fs::path& file, const Image& image) const {
    if (kind_ != TextureKind::srgb || image.channels != 2) return false;
    const std::string name = picture.file.string();
    if (picture.bytes == nullptr) {
      return is_two_channel_texture(*open_file(file, image_failure(name, "an image")), name);
    }
    const auto* const text = reinterpret_cast<const char*>(picture.bytes->data());
    return is_two_channel_texture(*bytes_in_memory({text, picture.bytes->size()}), name);
  }

  /// Adds a picture, or one of its channels (-1: all of them).
  /// \param weighted  true: its alpha weights the colours
  /// \returns its index in the texture
  std::uint32_t add(const std::shared_ptr<const Image>& image, int channel, bool weighted,
                    Texture& texture) {
    const auto [place, is_new] = picture_indices_.try_emplace(
        {image.get(), channel, weighted}, static_cast<std::uint32_t>(texture.images.size()));
    if (is_new) {
      texture.images.push_back(
          channel < 0 ? image : extract_channel(*image, static_cast<std::uint32_t>(channel)));
      texture.weighted_by_alpha.push_back(weighted);
    }
    return place->second;
  }

 private:
  using Key = std::pair<const void*, fs::path>;

  Image read_image(const MaterialPicture& picture, const fs::path& file) const {
    const std::string name = picture.file.string();
    Image image = picture.bytes ? load_image(*picture.bytes, name) : load_image(file);
    if (kind_ != TextureKind::srgb) return image;
    const auto is_linear = [&] {
      if (picture.bytes == nullptr) return holds_linear_light(file);
      const auto* const text = reinterpret_cast<const char*>(picture.bytes->data());
      return holds_linear_light(*bytes_in_memory({text, picture.bytes->size()}), name);
    };
    if (is_linear()) encode_colors(image);
    return image;
  }

  /// Encodes colours in linear light as sRGB, since most pictures are sRGB. Alpha is unchanged.
  static void encode_colors(Image& image) {
    const std::size_t colors = image.channels - (image.channels % 2 == 0 ? 1 : 0);
    for (std::size_t i = 0; i < image.pixels.size(); i += image.channels) {
      for (std::size_t c = i; c < i + colors; ++c) {
        image.pixels[c] = static_cast<float>(encode_srgb(image.pixels[c]));
      }
    }
  }

  TextureKind kind_;
  std::map<Key, std::shared_ptr<const Image>> pictures_read_;
  std::map<std::tuple<const Image*, int, bool>, std::uint32_t> picture_indices_;
};

/// Clears each list of one value per material if all of its values are the default.
void drop_default_lists(Texture& texture, std::uint32_t own_set) {
  const auto clear_if_all = [](auto& list, const auto& usual) {
    if (std::all_of(list.begin(), list.end(), [&](const auto& value) { return value == usual; })) {
      list.clear();
    }
  };
  clear_if_all(texture.uv_transforms, MaterialPicture().uv_transform);
  clear_if_all(texture.uv_sets, own_set);
  clear_if_all(texture.factors, Texture::Factor());
  clear_if_all(texture.wraps, MaterialPicture().wrap);
  clear_if_all(texture.times_vertex_colors, false);
  clear_if_all(texture.weighted_by_alpha, false);
}

void warn_of_tiles(const std::string& note, std::vector<Warning>* warnings) {
  if (note.empty() || warnings == nullptr) return;
  const bool is_reported =
      std::any_of(warnings->begin(), warnings->end(),
                  [&](const Warning& warning) { return warning.message == note; });
  if (!is_reported) warnings->push_back({"udim-siblings", note, 1});
}

/// Makes the texture of a slot from all materials.
/// \param mesh  null if it is not known
Texture load_texture(const std::vector<Material>& materials, MaterialSlot slot,
                     std::vector<Warning>* warnings, const KnownSets& known_sets, const Mesh* mesh,
                     NormalTextureFormat normals) {
  if (materials.empty()) {
    throw Error(ErrorCode::input,
                "The high poly has no materials: give a texture file, or an OBJ with its MTL.");
  }
  check_values(materials, slot, warnings);
  Texture texture;
  texture.normal_format = normals;
  const bool color = slot == MaterialSlot::color || slot == MaterialSlot::emission;
  texture.kind = slot == MaterialSlot::normal ? TextureKind::normal
                 : color                      ? TextureKind::srgb
                                              : TextureKind::linear;
  // If every material reads its opacity from the alpha channel of its colour picture, the texture is that channel.
  const bool in_alpha = slot == MaterialSlot::opacity &&
                        std::all_of(materials.begin(), materials.end(), reads_color_alpha);
  const bool among_gltf = std::any_of(materials.begin(), materials.end(),
                                      [](const Material& m) { return m.multiplies; });
  texture.channel = in_alpha ? 3 : 0;
  Pictures pictures(texture.kind);
  MaterialFinding heights, missing, two_channel;
  std::string first_missing;
  // Number of triangles on each UV tile; only computed if a file name may belong to a UDIM set
  std::vector<TileCounts> counts;
  std::map<std::tuple<fs::path, int, bool, TileCounts>, std::uint32_t> sets;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const Material& material = materials[m];
    const MaterialPicture& picture = source_picture(material, slot);
    texture.plain.push_back(default_value_of(material, slot));
    texture.image_of.push_back(Texture::kNone);
    texture.uv_transforms.push_back(picture.uv_transform);
    texture.wraps.push_back(picture.wrap);
    texture.uv_sets.push_back(picture.empty() ? known_sets.own_set : picture.uv_set);
    texture.factors.push_back(factor_of(material, slot, picture));
    // glTF multiplies the base colour, including alpha, by the vertex colours.
    texture.times_vertex_colors.push_back(
        (material.vertex_color && slot == MaterialSlot::color) ||
        (material.multiplies &&
         (slot == MaterialSlot::color ||
          (slot == MaterialSlot::opacity && material.alpha_mode != AlphaMode::opaque))));
    if (picture.empty()) continue;
    if (!known_sets.has(picture.uv_set)) {
      fail_for_missing_uv_set(material, slot, picture.uv_set, known_sets.own_set);
    }
    check_transform(material, picture.uv_transform);
    std::error_code error;
    if (picture.bytes == nullptr && !register_file_check(picture.file) &&
        !fs::exists(picture.file, error) && !is_picture_file(picture.file)) {
      if (missing.count() == 0) first_missing = picture.file.string();
      missing.add(material);
      continue;
    }
    TileFiles tiles;
    const TileCounts* used_tiles = nullptr;
    if (picture.bytes == nullptr && names_tile(picture.file)) {
      if (mesh != nullptr && counts.empty()) {
        std::vector<PicturePlace> places;
        for (const Material& other : materials) {
          const MaterialPicture& named = source_picture(other, slot);
          places.push_back({named.uv_set, named.uv_transform});
        }
        counts = count_tiles(*mesh, places);
      }
      if (mesh != nullptr) used_tiles = &counts[m];
      tiles = find_tiles(picture.file, used_tiles, [&](const fs::path& file) {
        return std::any_of(materials.begin(), materials.end(), [&](const Material& other) {
          const MaterialPicture& named = source_picture(other, slot);
          return named.file == file && named.file != picture.file;
        });
      });
      warn_of_tiles(tiles.note, warnings);
    }
    const int channel = channel_of(material, slot, picture, in_alpha, among_gltf);
    // Only one channel of a grey picture is read: JPEG compression may make its channels slightly
    // different.
    const auto channel_in = [&](const Image& image) {
      return channel < 0 && holds_number(slot) && image.channels >= 3 &&
                     is_grey(image, kLossyRounding)
                 ? 0
                 : channel;
    };
    const bool weighted = slot == MaterialSlot::color && is_alpha_opacity(material);
    if (tiles.tiles.empty()) {
      const std::shared_ptr<const Image> image = pictures.read(picture, picture.file);
      if (pictures.lacks_color(picture, picture.file, *image)) two_channel.add(material);
      if (slot == MaterialSlot::normal && holds_heights(*image, normals)) {
        heights.add(material);
        continue;
      }
      texture.image_of.back() = pictures.add(image, channel_in(*image), weighted, texture);
      continue;
    }
    const auto [set, is_new] = sets.try_emplace(
        {picture.file, channel, weighted, used_tiles != nullptr ? *used_tiles : TileCounts()},
        Texture::kNone);
    for (const auto& [tile, file] : is_new ? tiles.tiles : decltype(tiles.tiles)()) {
      const std::shared_ptr<const Image> image = pictures.read(picture, file);
      if (slot == MaterialSlot::normal && holds_heights(*image, normals)) continue;
      // A UDIM set is stored under the index of its first picture, which another material may use
      // without the set.
      if (set->second == Texture::kNone) {
        set->second = static_cast<std::uint32_t>(texture.images.size());
        const int image_channel = channel_in(*image);
        texture.images.push_back(
            image_channel < 0 ? image
                              : extract_channel(*image, static_cast<std::uint32_t>(image_channel)));
        texture.weighted_by_alpha.push_back(weighted);
        texture.tiles.push_back({set->second, tile, set->second});
        continue;
      }
      texture.tiles.push_back(
          {set->second, tile, pictures.add(image, channel_in(*image), weighted, texture)});
    }
    if (set->second == Texture::kNone) heights.add(material);
    texture.image_of.back() = set->second;
  }
  drop_default_lists(texture, known_sets.own_set);
  if (missing.count() != 0) {
    missing.warn(warnings, "picture-missing",
                 "with a missing picture ('" + first_missing +
                     "'): only the material's constant value is used.");
  }
  if (two_channel.count() != 0) {
    const std::string file = source_picture(two_channel.first(), slot).file.string();
    two_channel.warn(warnings, "two-channel-colors",
                     "with a texture of two channels" +
                         (file.empty() ? std::string() : " ('" + file + "')") +
                         " as colours: BC5 and its like hold x and y of normals, and were read as "
                         "grey and opacity. Give colours as BC7 or PNG, or this texture as normal "
                         "map.");
  }
  if (heights.count() != 0) {
    heights.warn(warnings, "bump-is-height",
                 "with a grey picture in place of a normal map ('" +
                     heights.first().normal_map.file.string() +
                     "'): it is a height map, and was ignored. Convert it to a normal map first.");
  }
  return texture;
}

}  // namespace

Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot,
                              std::vector<Warning>* warnings, std::uint32_t uv_set) {
  return load_texture(materials, slot, warnings, {uv_set, {}}, nullptr,
                      NormalTextureFormat::automatic);
}

Texture load_material_texture(const std::vector<Material>& materials, MaterialSlot slot,
                              const Mesh& mesh, std::vector<Warning>* warnings,
                              NormalTextureFormat normals) {
  return load_texture(materials, slot, warnings, {mesh.uv_set, mesh.other_uvs}, &mesh, normals);
}

Texture load_texture(const fs::path& file, const Mesh* mesh, std::vector<Warning>* warnings) {
  Texture texture;
  TileFiles tiles;
  if (names_tile(file)) {
    TileCounts counts;
    if (mesh != nullptr) counts = count_tiles(*mesh);
    tiles = find_tiles(file, mesh != nullptr ? &counts : nullptr);
    warn_of_tiles(tiles.note, warnings);
  }
  for (const auto& [tile, name] : tiles.tiles) {
    texture.tiles.push_back({0, tile, static_cast<std::uint32_t>(texture.images.size())});
    texture.images.push_back(std::make_shared<const Image>(load_image(name)));
  }
  if (texture.images.empty()) texture.images = {std::make_shared<const Image>(load_image(file))};
  const fs::path& first = tiles.tiles.empty() ? file : tiles.tiles[0].second;
  if (holds_linear_light(first)) texture.kind = TextureKind::linear;
  return texture;
}

Asset load_asset(const std::filesystem::path& path, const LoadMeshOptions& options,
                 std::vector<Warning>* warnings) {
  Asset asset;
  Mesh mesh = load_mesh_file(path, options, warnings, &asset);
  asset.mesh = std::move(mesh);
  FileFinder finder(path.parent_path());
  const auto exists = [&](std::string file) {
    std::replace(file.begin(), file.end(), '\\', '/');
    return register_file_check(finder.find(path.parent_path() / file, path.string()));
  };
  const std::vector<std::string>& files = asset.mesh.material_files;
  if (asset.materials.empty() && !is_gltf_name(path) && !files.empty() &&
      std::all_of(files.begin(), files.end(), exists)) {
    asset.materials = load_materials(asset.mesh, path, warnings, options.outside);
  }
  return asset;
}

}  // namespace kiln
