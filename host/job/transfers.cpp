#include "job/transfers.h"

#include <algorithm>
#include <climits>
#include <filesystem>
#include <memory>
#include <system_error>

#include "base/input_log.h"
#include "job/files.h"
#include "job/map_words.h"
#include "job/mesh_files.h"
#include "options/parse.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

bool needs_texture(const BakeOptions& options, std::string_view option) {
  const auto uses_option = [&](MapKind map) { return map_uses(map.name, option); };
  return std::any_of(options.maps.begin(), options.maps.end(), uses_option) ||
         std::any_of(options.variants.begin(), options.variants.end(),
                     [&](const MapVariant& map) { return uses_option(map.kind); });
}

bool has_pictures(const Texture& texture) { return !texture.images.empty(); }

/// Reads HIGH's materials on first use, and once.
class Materials {
 public:
  Materials(const Job& arguments, const Mesh& high, std::vector<Warning>& warnings,
            std::span<const Material> known_materials)
      : arguments_(arguments), high_(high), warnings_(warnings) {
    if (!known_materials.empty())
      materials_.emplace(known_materials.begin(), known_materials.end());
  }

  Texture texture(MaterialSlot slot) {
    return load_material_texture(all(), slot, high_, &warnings_, arguments_.high_normal_map);
  }
  bool have_colors() {
    return std::any_of(all().begin(), all().end(), [](const Material& material) {
      return material.color_from != MaterialNumber::none || !material.color_map.file.empty();
    });
  }

 private:
  const std::vector<Material>& all() {
    if (materials_) return *materials_;
    const std::size_t previous_warning_count = warnings_.size();
    materials_ =
        load_materials(high_, high_name(arguments_), &warnings_, arguments_.frame.allow_outside);
    for (std::size_t i = previous_warning_count; i < warnings_.size(); ++i) {
      // In joined files, materials of equal names count as one, so that parts of the map would show the material of
      // another file.
      if (warnings_[i].code != "materials-differ" || high_files(arguments_).size() < 2) continue;
      throw Error(ErrorCode::input,
                  quote_files(high_files(arguments_)) +
                      " have different materials of the same name: " + warnings_[i].message);
    }
    return *materials_;
  }

  const Job& arguments_;
  const Mesh& high_;
  std::vector<Warning>& warnings_;
  std::optional<std::vector<Material>> materials_;
};

Texture load_texture(const TransferArgument& transfer, Materials& materials, const Mesh& high,
                     const Job& arguments, std::vector<Warning>& warnings) {
  if (transfer.materials()) {
    Texture texture = materials.texture(Words(kMaterialSlots).at(transfer.name));
    if (transfer.kind) texture.kind = *transfer.kind;
    return texture;
  }
  Texture texture = kiln::load_texture(transfer.file, &high, &warnings);
  texture.kind = transfer.kind.value_or(texture.kind);
  texture.normal_format = arguments.high_normal_map;
  if (map_uses(transfer.name, "opacity")) {
    // The texture's alpha channel is used if there is one, else its first channel.
    texture.kind = transfer.kind.value_or(TextureKind::linear);
    texture.channel = texture.images[0]->channels % 2 == 0 ? 3 : 0;
  } else if (texture.kind == TextureKind::srgb) {
    // The alpha of a single picture is its opacity, which weights the colours.
    texture.weighted_by_alpha.assign(texture.images.size(), true);
  }
  return texture;
}

}  // namespace

bool is_transparent(const Material& m) {
  return m.alpha_mode != AlphaMode::opaque &&
         (m.opacity < 1 || !m.opacity_map.empty() || m.vertex_opacity);
}

namespace {

/// The texture slots that the materials of a high poly use, without occlusion. Vertex colours count as the colour slot.
std::vector<MaterialSlot> used_material_slots(const Mesh& high,
                                              std::span<const Material> materials) {
  const auto any_material = [&](const auto& predicate) {
    return std::any_of(materials.begin(), materials.end(), predicate);
  };
  const auto has_constant = [](MaterialNumber from) { return from != MaterialNumber::none; };
  std::vector<MaterialSlot> used_slots;
  const auto add = [&](bool is_used, MaterialSlot slot) {
    if (is_used) used_slots.push_back(slot);
  };
  add(!high.colors.empty() || any_material([&](const Material& m) {
    return has_constant(m.color_from) || !m.color_map.empty();
  }),
      MaterialSlot::color);
  add(any_material(is_transparent), MaterialSlot::opacity);
  add(any_material([](const Material& m) { return !m.normal_map.empty(); }), MaterialSlot::normal);
  add(any_material([&](const Material& m) {
        return has_constant(m.roughness_from) || !m.roughness_map.empty();
      }),
      MaterialSlot::roughness);
  add(any_material([&](const Material& m) {
        return !m.metallic_map.empty() || (has_constant(m.metallic_from) && m.metallic > 0);
      }),
      MaterialSlot::metallic);
  add(any_material([&](const Material& m) {
        return !m.emission_map.empty() ||
               (has_constant(m.emission_from) && m.emission != std::array<float, 3>{});
      }),
      MaterialSlot::emission);
  return used_slots;
}

}  // namespace

namespace {

bool has_uv_set(const Mesh& mesh, std::uint32_t set) {
  return set == mesh.uv_set || std::any_of(mesh.other_uvs.begin(), mesh.other_uvs.end(),
                                           [set](const UvSet& other) { return other.set == set; });
}

}  // namespace

MaterialMaps material_maps(const Mesh& high, std::span<const Material> materials, bool occlusion,
                           std::vector<Warning>& warnings) {
  MaterialMaps found;
  for (const MaterialSlot slot : used_material_slots(high, materials)) {
    const std::string name = name_of(Words(kMaterialSlots), slot);
    if (slot == MaterialSlot::color || slot == MaterialSlot::opacity) {
      found.maps.push_back(name);
    } else {
      found.transfers.push_back("mtl:" + name);
    }
  }
  std::uint64_t missing_uv_sets = 0;
  const bool pictures = std::any_of(materials.begin(), materials.end(), [&](const Material& m) {
    const bool has_map = !m.occlusion_map.empty();
    if (has_map && !has_uv_set(high, m.occlusion_map.uv_set)) ++missing_uv_sets;
    return has_map;
  });
  if (pictures && missing_uv_sets == 0 && occlusion) found.transfers.emplace_back("mtl:occlusion");
  if (missing_uv_sets != 0) {
    warnings.push_back({"occlusion-left-out",
                        "HIGH's occlusion texture uses a UV set that HIGH does not have, and is "
                        "left out; the map `ao` shows the occlusion of HIGH's shape.",
                        missing_uv_sets});
  }
  const auto transparent_count = static_cast<std::uint64_t>(std::count_if(
      high.colors.begin(), high.colors.end(), [](const auto& c) { return c[3] < 255; }));
  const auto multiplies_vertex_colors = [](const Material& m) { return m.multiplies; };
  if (transparent_count != 0 &&
      std::none_of(materials.begin(), materials.end(), multiplies_vertex_colors)) {
    warnings.push_back({"opacity-left-out",
                        "HIGH's vertex colours have alpha, which is ignored, since no material "
                        "uses it: add opacity to " +
                            option("maps") + " to bake it.",
                        transparent_count});
  }
  return found;
}

std::vector<OwnMap> load_own_maps(const Job& a) {
  constexpr std::size_t kMaxSourceBytes = std::size_t{1} << 20;
  std::vector<OwnMap> maps;
  for (const std::string& text : a.own_maps) {
    const std::size_t equals = text.find('=');
    OwnMap map;
    map.name = text.substr(0, equals);
    map.file = text.substr(equals + 1);
    map.source = read_small_file(map.file, kMaxSourceBytes, option("maps") + " '" + text + "'");
    maps.push_back(std::move(map));
  }
  return maps;
}

namespace {

/// True if all colours are white, whatever their alpha, or if there are none.
bool is_white(std::span<const std::array<std::uint8_t, 4>> colors) {
  return std::all_of(colors.begin(), colors.end(), [](const std::array<std::uint8_t, 4>& c) {
    return c[0] == 255 && c[1] == 255 && c[2] == 255;
  });
}

}  // namespace

void load_textures(const Job& arguments, const Mesh& high, BakeOptions& options,
                   std::vector<Warning>& warnings, std::span<const Material> known_materials) {
  Materials materials(arguments, high, warnings, known_materials);
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    Texture texture = load_texture(transfer, materials, high, arguments, warnings);
    if (map_uses(transfer.name, "color")) {
      options.color = std::move(texture);
    } else if (map_uses(transfer.name, "opacity")) {
      options.opacity = std::move(texture);
    } else {
      options.transfers.push_back({transfer.name, std::move(texture)});
    }
  }
  if (high.material_files.empty() && known_materials.empty()) return;
  if (needs_texture(options, "color") && !options.color &&
      (high.colors.empty() || materials.have_colors())) {
    Texture texture = materials.texture(MaterialSlot::color);
    // Vertex colours take precedence over a constant material colour, unless they multiply it or are all white, since
    // some programs write white for meshes without colours.
    if (has_pictures(texture) || is_white(high.colors) || !texture.times_vertex_colors.empty()) {
      options.color = std::move(texture);
    }
  }
  if ((needs_texture(options, "opacity") || arguments.alpha_test > 0) && !options.opacity) {
    options.opacity = materials.texture(MaterialSlot::opacity);
  }
}

void apply_alpha_test(const Job& arguments, const BakeOptions& options, Mesh& high,
                      std::vector<Warning>& warnings) {
  if (arguments.alpha_test <= 0) return;
  if (!options.opacity) {
    throw OptionError(option("alpha_test") + ": " + quote_files(high_files(arguments)) +
                          " names no materials: give the texture by " + option("transfer") +
                          " "
                          "FILE:opacity.",
                      ErrorCode::input);
  }
  CutOutReport report;
  high = cut_out(high, *options.opacity, arguments.alpha_test, &report);
  if (report.cut + report.gone != 0) return;
  warnings.push_back({"alpha-test-idle",
                      option("alpha_test") + " found no transparent texel of " +
                          quote_files(high_files(arguments)) +
                          ": check that its pictures have an alpha channel.",
                      1});
}

namespace {

constexpr Word<TextureKind> kTextureKinds[] = {
    {"linear", TextureKind::linear}, {"normal", TextureKind::normal}, {"srgb", TextureKind::srgb}};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool is_map_name(const std::string& text) {
  return !text.empty() && is_letter(text[0]) && std::all_of(text.begin(), text.end(), [](char c) {
    return is_letter(c) || c == '_' || (c >= '0' && c <= '9');
  });
}

/// Derives a map's name from the stem of a file.
std::string name_of_file(const std::string& file) {
  std::string name = fs::path(file).stem().string();
  for (char& c : name) {
    if (!is_letter(c) && !(c >= '0' && c <= '9')) c = '_';
  }
  return is_map_name(name) ? name : "t_" + name;
}

/// Splits off and returns the part after the last colon of a text; nullopt if there is no colon.
std::optional<std::string> split_last_part(std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  std::string part = text.substr(colon + 1);
  text.resize(colon);
  return part;
}

/// True for an existing file or UDIM set. Names that exceed PATH_MAX are rejected at once, since the checks of all
/// their parts would take quadratic time.
bool is_existing_input(const std::string& file) {
  if (file.size() >= PATH_MAX) return false;
  std::error_code ignored;
  return register_file_check(file) || fs::exists(file, ignored) || is_picture_file(file);
}

/// Rejects an unknown word after a colon if the text before the colon is a file. \throws Error(usage)
void reject_unknown_suffix(const std::string& text, const std::string& file) {
  if (is_existing_input(file)) return;
  refuse_if(file.starts_with("mtl:"),
            option("transfer") + " '" + text + "': '" + text.substr(text.rfind(':') + 1) +
                "' is no colour space, and textures of materials cannot be renamed. Give mtl:SLOT "
                "or mtl:SLOT:SPACE, where SPACE is srgb, linear or normal.");
  for (std::string prefix = file; split_last_part(prefix);) {
    if (!is_existing_input(prefix)) continue;
    fail_usage(option("transfer") + " '" + text + "': '" + text.substr(text.rfind(':') + 1) +
               "' is no colour space. Give FILE, FILE:NAME or "
               "FILE:NAME:SPACE, where SPACE is srgb, linear or normal.");
  }
}

}  // namespace

TransferArgument parse_transfer(const std::string& text) {
  TransferArgument transfer;
  transfer.file = text;
  std::string prefix = text;
  if (std::optional<std::string> part = split_last_part(prefix)) {
    if (const TextureKind* const kind = Words(kTextureKinds).find(*part)) {
      transfer.kind = *kind;
      transfer.file = prefix;
      part = split_last_part(prefix);
    }
    if (part && is_map_name(*part)) {
      transfer.name = *part;
      transfer.file = prefix;
    }
  }
  if (transfer.materials()) {
    refuse_if(!Words(kMaterialSlots).contains(transfer.name),
              option("transfer") + " '" + text +
                  "': give mtl:color, mtl:opacity, mtl:normals, mtl:roughness, mtl:metallic, "
                  "mtl:emission or mtl:occlusion.");
    return transfer;
  }
  reject_unknown_suffix(text, transfer.file);
  if (transfer.name.empty()) transfer.name = name_of_file(transfer.file);
  return transfer;
}

std::vector<TransferArgument> parse_transfers(const Job& arguments) {
  std::vector<TransferArgument> transfers;
  for (const std::string& text : arguments.transfers) transfers.push_back(parse_transfer(text));
  return transfers;
}

}  // namespace kiln
