#include "picture/view_page.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>

#include "base/process.h"
#include "batch/report.h"
#include "kiln/error.h"
#include "kiln/image.h"
#include "kiln/texture_sets.h"
#include "mesh/normals.h"

namespace kiln::cli {

extern const char kViewPage[];

namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little,
              "Typed arrays of browsers are little-endian.");

template <typename T>
std::string encoded(const std::vector<T>& values) {
  return base64({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
}

std::int16_t to_signed_16_bits(float value) {
  return static_cast<std::int16_t>(std::lround(std::clamp(value, -1.0F, 1.0F) * 32767));
}

/// A vertex buffer for a GPU. Corners with equal position, normal, UV and tangent share a vertex.
class VertexBuffer {
 public:
  VertexBuffer(const Mesh& mesh, bool with_uvs)
      : mesh_(mesh), with_uvs_(with_uvs && !mesh.uv_triangles.empty()) {
    normals_ = corner_normals(mesh, mesh.positions);
    if (with_uvs_) tangents_ = tangents_of(mesh);
    std::vector<std::uint32_t> order(mesh.triangles.size());
    for (std::uint32_t t = 0; t < order.size(); ++t) order[t] = t;
    if (!mesh.materials.empty()) {
      std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return mesh.materials[a] < mesh.materials[b];
      });
    }
    for (const std::uint32_t t : order) add(t);
  }

  Json to_json() const {
    Json groups = Json::array();
    for (const auto& [material, range] : groups_) {
      groups.push_back(Json::array({range[0], range[1], material}));
    }
    Json json = {{"faces", mesh_.triangles.size()}, {"vertices", positions_.size() / 3},
                 {"position", encoded(positions_)}, {"normal", encoded(normal_)},
                 {"index", encoded(index_)},        {"groups", groups}};
    if (with_uvs_) {
      json["uv"] = encoded(uv_);
      json["tangent"] = encoded(tangent_);
    }
    if (!mesh_.colors.empty()) json["color"] = encoded(color_);
    return json;
  }

 private:
  using Key = std::array<std::uint32_t, 4>;
  struct KeyHash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      for (const std::uint32_t part : key) hash = (hash ^ part) * 0x9E3779B97F4A7C15U;
      return static_cast<std::size_t>(hash ^ hash >> 32U);
    }
  };

  void add(std::uint32_t t) {
    const std::uint32_t material = mesh_.materials.empty() ? 0 : mesh_.materials[t];
    if (groups_.empty() || groups_.back().first != material) {
      groups_.push_back({material, {static_cast<std::uint32_t>(index_.size()), 0}});
    }
    for (std::size_t k = 0; k < 3; ++k) {
      Key key{mesh_.triangles[t][k], normals_.triangles[t][k], 0, 0};
      std::array<std::int16_t, 4> tangent{};
      if (with_uvs_) {
        const Tangent& corner = tangents_[std::size_t{3} * t + k];
        const Vec3& d = corner.direction;
        const float length = std::hypot(d.x, d.y, d.z);
        const float scale = length > 0 ? 1 / length : 0;
        tangent = {to_signed_16_bits(d.x * scale), to_signed_16_bits(d.y * scale),
                   to_signed_16_bits(d.z * scale),
                   to_signed_16_bits(corner.sign < 0 ? -1.0F : 1.0F)};
        key[2] = mesh_.uv_triangles[t][k];
        std::uint64_t bits = 0;
        std::memcpy(&bits, tangent.data(), sizeof bits);
        key[3] = static_cast<std::uint32_t>(bits ^ bits >> 32U);
      }
      const auto [entry, added] =
          vertices_.try_emplace(key, static_cast<std::uint32_t>(positions_.size() / 3));
      index_.push_back(entry->second);
      ++groups_.back().second[1];
      if (!added) continue;
      const Vec3 &p = mesh_.positions[key[0]], &n = normals_.normals[key[1]];
      positions_.insert(positions_.end(), {p.x, p.y, p.z});
      normal_.insert(normal_.end(),
                     {to_signed_16_bits(n.x), to_signed_16_bits(n.y), to_signed_16_bits(n.z)});
      if (with_uvs_) {
        const Vec2& uv = mesh_.uvs[key[2]];
        uv_.insert(uv_.end(), {uv.x, uv.y});
        tangent_.insert(tangent_.end(), tangent.begin(), tangent.end());
      }
      if (!mesh_.colors.empty()) {
        const auto& color = mesh_.colors[key[0]];
        color_.insert(color_.end(), color.begin(), color.begin() + 3);
      }
    }
  }

  const Mesh& mesh_;
  bool with_uvs_ = false;
  CornerNormals normals_;
  std::vector<Tangent> tangents_;
  std::unordered_map<Key, std::uint32_t, KeyHash> vertices_;
  std::vector<float> positions_, uv_;
  std::vector<std::int16_t> normal_, tangent_;
  std::vector<std::uint8_t> color_;
  std::vector<std::uint32_t> index_;
  std::vector<std::pair<std::uint32_t, std::array<std::uint32_t, 2>>> groups_;
};

/// Distinct textures of the page.
class PictureList {
 public:
  /// Adds a texture, or finds an equal one. \param channel  the channel to write as grey; nullopt: colours, with alpha
  /// if `with_alpha`
  std::size_t add(const std::shared_ptr<const Image>& image, std::optional<std::uint32_t> channel,
                  const Texture::Factor& factor, bool with_alpha, const std::string& name) {
    const Key key{image.get(),
                  channel      ? static_cast<int>(*channel)
                  : with_alpha ? -2
                               : -1,
                  factor.times[0], factor.plus};
    const auto [entry, added] =
        picture_index_by_key_.try_emplace(key, picture_index_by_key_.size());
    if (!added) return entry->second;
    kept_images_.push_back(image);
    Image picture{image->width, image->height, channel ? 1U : with_alpha ? 4U : 3U, {}};
    picture.pixels.resize(std::size_t{picture.width} * picture.height * picture.channels);
    for (std::size_t i = 0; i < std::size_t{picture.width} * picture.height; ++i) {
      const float* const from = &image->pixels[i * image->channels];
      float* const to = &picture.pixels[i * picture.channels];
      if (channel) {
        to[0] = *channel < image->channels ? from[*channel] * factor.times[0] + factor.plus : 1;
        continue;
      }
      for (std::size_t c = 0; c < 3; ++c) to[c] = from[image->channels < 3 ? 0 : c];
      if (with_alpha) to[3] = image->channels % 2 == 0 ? from[image->channels - 1] : 1;
    }
    SaveImageOptions options;
    options.format = ImageFormat::png8;
    const std::vector<std::byte> bytes = encode(picture, options);
    list_.push_back(Json{{"uri", "data:image/png;base64," + encoded(bytes)},
                         {"name", name},
                         {"width", image->width},
                         {"height", image->height}});
    return entry->second;
  }
  const Json& list() const { return list_; }

 private:
  using Key = std::tuple<const Image*, int, float, float>;
  std::map<Key, std::size_t> picture_index_by_key_;
  /// Keeps images alive, since keys contain their addresses
  std::vector<std::shared_ptr<const Image>> kept_images_;
  Json list_ = Json::array();
};

const char* wrap_name(TextureWrap wrap) {
  return wrap == TextureWrap::repeat ? "repeat" : wrap == TextureWrap::clamp ? "clamp" : "mirror";
}

struct SlotRow {
  const char* name;
  MaterialSlot slot;
  MaterialPicture Material::*picture;
  bool is_number;
};
constexpr std::array kSlots = {
    SlotRow{"color", MaterialSlot::color, &Material::color_map, false},
    SlotRow{"normal", MaterialSlot::normal, &Material::normal_map, false},
    SlotRow{"roughness", MaterialSlot::roughness, &Material::roughness_map, true},
    SlotRow{"metallic", MaterialSlot::metallic, &Material::metallic_map, true},
    SlotRow{"occlusion", MaterialSlot::occlusion, &Material::occlusion_map, true},
    SlotRow{"emission", MaterialSlot::emission, &Material::emission_map, false},
    SlotRow{"opacity", MaterialSlot::opacity, &Material::opacity_map, true},
};

/// The UV set with which a material is drawn: that of its colour picture, else of its first picture. Three.js has one
/// UV set for all pictures but occlusion.
std::uint32_t select_uv_set(const Material& material, std::uint32_t own) {
  for (const SlotRow& row : kSlots) {
    const MaterialPicture& picture = material.*row.picture;
    if (!picture.empty()) return picture.uv_set;
  }
  return own;
}

/// The mesh with the UVs of each material's select_uv_set(); nullopt if the mesh's own UVs serve all materials.
std::optional<Mesh> with_drawn_sets(const ViewedMesh& viewed) {
  const Mesh& mesh = *viewed.mesh;
  if (mesh.uvs.empty() || mesh.other_uvs.empty() || viewed.materials.empty()) return std::nullopt;
  std::vector<std::uint32_t> first_of(viewed.materials.size(), 0);
  bool any_other = false;
  for (std::size_t m = 0; m < first_of.size(); ++m) {
    const std::uint32_t set = select_uv_set(viewed.materials[m], mesh.uv_set);
    for (std::size_t k = 0; k < mesh.other_uvs.size() && set != mesh.uv_set; ++k) {
      if (mesh.other_uvs[k].set != set) continue;
      first_of[m] = static_cast<std::uint32_t>((k + 1) * mesh.uvs.size());
      any_other = true;
    }
  }
  if (!any_other) return std::nullopt;
  Mesh result = mesh;
  for (const UvSet& other : mesh.other_uvs)
    result.uvs.insert(result.uvs.end(), other.uvs.begin(), other.uvs.end());
  for (std::size_t t = 0; t < result.triangles.size(); ++t) {
    const std::uint32_t material = mesh.materials.empty() ? 0 : mesh.materials[t];
    for (std::uint32_t& corner : result.uv_triangles[t]) corner += first_of[material];
  }
  result.other_uvs.clear();
  result.tangents.clear();  // The tangents in the file belong to another UV set
  return result;
}

/// Leaves out pictures on another UV set than the drawn one, with a warning.
void leave_out_other_sets(const ViewedMesh& viewed, std::vector<Material>& materials,
                          std::vector<Warning>& warnings) {
  for (Material& of : materials) {
    const std::uint32_t set = select_uv_set(of, viewed.mesh->uv_set);
    for (const SlotRow& row : kSlots) {
      MaterialPicture& picture = of.*row.picture;
      if (picture.empty() || picture.uv_set == set) continue;
      warnings.push_back({"view-uv-set",
                          "'" + of.name + "': its picture of " + row.name + " uses UV set " +
                              std::to_string(picture.uv_set) +
                              ", but the material is drawn with set " + std::to_string(set) +
                              ": the picture is left out.",
                          1});
      picture = {};
    }
  }
}

/// Describes a slot of a material: its picture, or its value.
Json slot_json(const SlotRow& row, const Texture& texture, std::size_t material, const Material& of,
               PictureList& pictures) {
  const Texture::Factor factor =
      texture.factors.empty() ? Texture::Factor{} : texture.factors[material];
  const std::uint32_t image = texture.image_of.empty() ? 0 : texture.image_of[material];
  if (image == Texture::kNone) {
    const auto& plain_value = texture.plain[material];
    return {{"value", Json::array({plain_value[0], plain_value[1], plain_value[2]})}};
  }
  const bool with_alpha =
      row.slot == MaterialSlot::color && of.alpha_mode != AlphaMode::opaque && of.multiplies;
  const std::size_t number =
      row.is_number ? pictures.add(texture.images[image], texture.channel, factor, false, row.name)
                    : pictures.add(texture.images[image], std::nullopt, {}, with_alpha, row.name);
  Json json = {{"image", number},
               {"value", Json::array({factor.times[0], factor.times[1], factor.times[2]})}};
  const std::array<TextureWrap, 2> wrap =
      texture.wraps.empty() ? std::array<TextureWrap, 2>{} : texture.wraps[material];
  json["wrap"] = Json::array({wrap_name(wrap[0]), wrap_name(wrap[1])});
  if (!texture.uv_transforms.empty()) json["matrix"] = Json(texture.uv_transforms[material]);
  return json;
}

Json materials_json(const ViewedMesh& viewed, PictureList& pictures,
                    std::vector<Warning>& warnings) {
  std::vector<Material> materials = viewed.materials;
  if (materials.empty())
    materials.resize(std::max<std::size_t>(1, viewed.mesh->material_names.size()));
  leave_out_other_sets(viewed, materials, warnings);
  Json list = Json::array();
  for (const Material& material : materials) {
    const bool clear = material.multiplies || material.opacity < 1 || !material.opacity_map.empty();
    const char* const alpha = !clear || material.alpha_mode == AlphaMode::opaque ? "opaque"
                              : material.alpha_mode == AlphaMode::mask           ? "cutout"
                                                                                 : "blend";
    list.push_back(Json{{"name", material.name},
                        {"alpha", alpha},
                        {"cutoff", material.alpha_cutoff},
                        {"opacity", material.opacity},
                        {"double_sided", material.double_sided},
                        {"normal_scale", material.normal_scale},
                        {"slots", Json::object()}});
  }
  if (viewed.materials.empty() || viewed.mesh->uvs.empty()) return list;
  const auto slot_of = [&](std::size_t material, const SlotRow& row) -> Json& {
    return list[material]["slots"][row.name];
  };
  for (const SlotRow& row : kSlots) {
    const bool any_transparent =
        std::any_of(materials.begin(), materials.end(),
                    [&](const Material& of) { return !(of.*row.picture).empty(); });
    if (!any_transparent) {
      for (std::size_t m = 0; m < materials.size(); ++m) {
        const Material& material = materials[m];
        const auto number = [&](float value) {
          slot_of(m, row) = {{"value", Json::array({value, value, value})}};
        };
        if (row.slot == MaterialSlot::color && material.color_from != MaterialNumber::none)
          slot_of(m, row) = {
              {"value", Json::array({material.color[0], material.color[1], material.color[2]})}};
        if (row.slot == MaterialSlot::roughness && material.roughness_from != MaterialNumber::none)
          number(material.roughness);
        if (row.slot == MaterialSlot::metallic && material.metallic_from != MaterialNumber::none)
          number(material.metallic);
        if (row.slot == MaterialSlot::emission && material.emission_from != MaterialNumber::none) {
          slot_of(m, row) = {{"value", Json::array({material.emission[0], material.emission[1],
                                                    material.emission[2]})}};
        }
      }
      continue;
    }
    const Texture texture = load_material_texture(materials, row.slot, *viewed.mesh, &warnings);
    if (!texture.tiles.empty()) {
      warnings.push_back({"view-udim",
                          std::string("UDIM sets are not shown: ") + row.name + " of '" +
                              viewed.mesh->name + "' is left out.",
                          1});
      continue;
    }
    for (std::size_t m = 0; m < materials.size(); ++m) {
      const bool needs_picture =
          row.slot == MaterialSlot::normal || row.slot == MaterialSlot::opacity;
      if (needs_picture && (materials[m].*row.picture).empty()) continue;
      // A multiplied opacity is stored as the alpha of the colour's picture.
      if (row.slot == MaterialSlot::opacity && materials[m].multiplies) continue;
      slot_of(m, row) = slot_json(row, texture, m, materials[m], pictures);
    }
  }
  return list;
}

/// The folder of three.js: the one in KILN_THREE, else the one beside this program in a package (tools/package), else
/// that of Debian's libjs-three.
fs::path find_three_js_folder() {
  const char* const chosen = std::getenv("KILN_THREE");
  if (chosen != nullptr && *chosen != '\0') return chosen;
  std::array<char, 4096> own_folder{};
  os::own_folder(own_folder);
  const fs::path packed = fs::path(own_folder.data()) / "three";
  std::error_code error;
  if (own_folder[0] != '\0' && fs::exists(packed, error)) return packed;
  return "/usr/share/javascript/three";
}

/// Reads a file of three.js.
std::string library_text(const fs::path& name) {
  const fs::path path = find_three_js_folder() / name;
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file || text.empty()) {
    throw Error(ErrorCode::input,
                "'" + path.string() +
                    "' is missing: pages need three.js. Install it with 'apt install libjs-three' "
                    "on Debian, or set KILN_THREE to its folder (r111).",
                "three-missing");
  }
  return text;
}

/// Escapes JSON for a script element, since names may contain "</script>".
std::string script_text(const Json& json) {
  std::string text;
  for (const char c : json.dump()) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

std::string html_text(const std::string& plain) {
  std::string text;
  for (const char c : plain) {
    text += c == '<' ? "&lt;" : c == '&' ? "&amp;" : c == '"' ? "&quot;" : std::string(1, c);
  }
  return text;
}

}  // namespace

std::string view_page(const ViewPage& page, const ViewedMesh& low, const ViewedMesh* high,
                      std::vector<Warning>& warnings) {
  PictureList pictures;
  Json meshes = Json::array();
  const auto add = [&](const ViewedMesh& viewed) {
    const std::optional<Mesh> drawn = with_drawn_sets(viewed);
    Json json = VertexBuffer(drawn ? *drawn : *viewed.mesh, !viewed.materials.empty()).to_json();
    json["materials"] = materials_json(viewed, pictures, warnings);
    meshes.push_back(json);
  };
  add(low);
  if (high != nullptr) add(*high);
  Json facts = Json::array();
  for (const auto& [name, value] : page.facts) facts.push_back(Json::array({name, value}));
  const Json data = {{"title", page.title},
                     {"facts", facts},
                     {"z_up", page.z_up},
                     {"meshes", meshes},
                     {"images", pictures.list()}};
  const std::map<std::string, std::string> texts = {
      {"@TITLE@", html_text(page.title)},
      {"@DATA@", script_text(data)},
      {"@THREE@", library_text("three.min.js")},
      {"@CONTROLS@", library_text("examples/js/controls/OrbitControls.js")}};
  std::string result;
  std::string_view remaining_page = kViewPage;
  while (!remaining_page.empty()) {
    const std::size_t mark_start = remaining_page.find('@');
    result += remaining_page.substr(0, mark_start);
    if (mark_start == std::string_view::npos) break;
    remaining_page.remove_prefix(mark_start);
    const auto text = std::find_if(texts.begin(), texts.end(), [&](const auto& entry) {
      return remaining_page.starts_with(entry.first);
    });
    result += text != texts.end() ? text->second : "@";
    remaining_page.remove_prefix(text != texts.end() ? text->first.size() : 1);
  }
  return result;
}

}  // namespace kiln::cli
