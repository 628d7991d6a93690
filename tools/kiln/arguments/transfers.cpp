#include "arguments/transfers.h"

#include <algorithm>
#include <map>
#include <memory>

#include "arguments/bake_values.h"
#include "arguments/mesh_files.h"
#include "arguments/small_file.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMaterials = "mtl";

const std::map<std::string, MaterialSlot>& slot_values() {
  static const std::map<std::string, MaterialSlot> values = {
      {"color", MaterialSlot::color},       {"opacity", MaterialSlot::opacity},
      {"normals", MaterialSlot::normal},    {"roughness", MaterialSlot::roughness},
      {"metallic", MaterialSlot::metallic}, {"emission", MaterialSlot::emission}};
  return values;
}

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool is_name(const std::string& text) {
  return !text.empty() && is_letter(text[0]) && std::all_of(text.begin(), text.end(), [](char c) {
    return is_letter(c) || c == '_' || (c >= '0' && c <= '9');
  });
}

/// A name of a file's stem.
std::string name_of_file(const std::string& file) {
  std::string name = fs::path(file).stem().string();
  for (char& c : name) {
    if (!is_letter(c) && !(c >= '0' && c <= '9')) c = '_';
  }
  return is_name(name) ? name : "t_" + name;
}

/// Takes the part after the last colon off a text, where there is one.
std::optional<std::string> last_part(std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  std::string part = text.substr(colon + 1);
  text.resize(colon);
  return part;
}

/// Where no such file is there, but one before a colon is: the words after it are wrong. \throws Error(usage)
void check_words(const std::string& text, const std::string& file) {
  if (fs::exists(file)) return;
  for (std::string rest = file; last_part(rest);) {
    if (!fs::exists(rest)) continue;
    throw Error(ErrorCode::usage, "--transfer '" + text + "': '" +
                                      text.substr(text.rfind(':') + 1) +
                                      "' is no colour space. Give FILE, FILE:NAME or "
                                      "FILE:NAME:SPACE, where SPACE is srgb, linear or normal.");
  }
}

bool asks(const BakeOptions& options, std::string_view map) {
  return std::find(options.maps.begin(), options.maps.end(), MapKind{map}) != options.maps.end();
}

bool has_pictures(const Texture& texture) { return !texture.images.empty(); }

/// Reads each file of materials once, when first asked for.
class Materials {
 public:
  Materials(const BakeArguments& arguments, const Mesh& high, std::vector<Warning>& warnings)
      : arguments_(arguments), high_(high), warnings_(warnings) {}

  Texture texture(MaterialSlot slot) {
    if (!read_) read_ = load_materials(high_, arguments_.high, &warnings_);
    return load_material_texture(*read_, slot);
  }

 private:
  const BakeArguments& arguments_;
  const Mesh& high_;
  std::vector<Warning>& warnings_;
  std::optional<std::vector<Material>> read_;
};

Texture load_texture(const TransferArgument& transfer, Materials& materials) {
  if (transfer.file == kMaterials) {
    Texture texture = materials.texture(slot_values().at(transfer.name));
    if (transfer.kind) texture.kind = *transfer.kind;
    return texture;
  }
  Texture texture;
  // Values of EXR are light already.
  std::string ending = fs::path(transfer.file).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  texture.kind = transfer.kind.value_or(ending == ".exr" ? TextureKind::linear : TextureKind::srgb);
  texture.images = {std::make_shared<const Image>(load_image(transfer.file))};
  if (transfer.name == "opacity") {
    // Its alpha where it has one, else what it shows.
    texture.kind = transfer.kind.value_or(TextureKind::linear);
    texture.channel = texture.images[0]->channels % 2 == 0 ? 3 : 0;
  }
  return texture;
}

}  // namespace

TransferArgument parse_transfer(const std::string& text) {
  TransferArgument transfer;
  transfer.file = text;
  std::string rest = text;
  if (std::optional<std::string> part = last_part(rest)) {
    if (const auto kind = texture_kind_values().find(*part); kind != texture_kind_values().end()) {
      transfer.kind = kind->second;
      transfer.file = rest;
      part = last_part(rest);
    }
    if (part && is_name(*part)) {
      transfer.name = *part;
      transfer.file = rest;
    }
  }
  if (transfer.file == kMaterials) {
    if (!slot_values().contains(transfer.name)) {
      throw Error(ErrorCode::usage,
                  "--transfer '" + text +
                      "': of materials it takes mtl:color, opacity, normals, roughness, metallic "
                      "or emission.");
    }
    return transfer;
  }
  check_words(text, transfer.file);
  if (transfer.name.empty()) transfer.name = name_of_file(transfer.file);
  return transfer;
}

std::vector<TransferArgument> parse_transfers(const BakeArguments& arguments) {
  std::vector<TransferArgument> transfers;
  for (const std::string& text : arguments.transfers) transfers.push_back(parse_transfer(text));
  return transfers;
}

std::vector<std::string> own_map_names(const BakeArguments& arguments) {
  std::vector<std::string> names;
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    if (transfer.name != "color" && transfer.name != "opacity") names.push_back(transfer.name);
  }
  for (const std::string& text : arguments.own_maps)
    names.push_back(text.substr(0, text.find('=')));
  return names;
}

void part_maps(BakeArguments& a) {
  std::vector<std::string> maps;
  for (const std::string& map : a.maps) {
    (map.find('=') == std::string::npos ? maps : a.own_maps).push_back(map);
  }
  a.maps = std::move(maps);
}

std::vector<OwnMap> load_own_maps(const BakeArguments& a) {
  constexpr std::size_t kMost = std::size_t{1} << 20;
  std::vector<OwnMap> maps;
  for (const std::string& text : a.own_maps) {
    const std::size_t equals = text.find('=');
    OwnMap map;
    map.name = text.substr(0, equals);
    map.file = text.substr(equals + 1);
    map.source = read_small_file(map.file, kMost, "--maps '" + text + "'");
    maps.push_back(std::move(map));
  }
  return maps;
}

std::vector<std::string> maps_asked(const BakeArguments& arguments) {
  std::vector<std::string> maps = arguments.maps;
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    const bool known = transfer.name == "color" || transfer.name == "opacity";
    if (known && std::find(maps.begin(), maps.end(), transfer.name) == maps.end()) {
      maps.push_back(transfer.name);
    }
  }
  return maps;
}

void load_textures(const BakeArguments& arguments, const Mesh& high, BakeOptions& options,
                   std::vector<Warning>& warnings) {
  Materials materials(arguments, high, warnings);
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    Texture texture = load_texture(transfer, materials);
    if (transfer.name == "color") {
      options.color = std::move(texture);
    } else if (transfer.name == "opacity") {
      options.opacity = std::move(texture);
    } else {
      options.transfers.push_back({transfer.name, std::move(texture)});
    }
  }
  if (high.material_files.empty()) return;
  if (asks(options, "color") && !options.color) {
    Texture texture = materials.texture(MaterialSlot::color);
    // Vertex colours say more than a plain material.
    if (has_pictures(texture) || high.colors.empty()) options.color = std::move(texture);
  }
  if ((asks(options, "opacity") || arguments.alpha_test > 0) && !options.opacity) {
    options.opacity = materials.texture(MaterialSlot::opacity);
  }
}

void apply_alpha_test(const BakeArguments& arguments, const BakeOptions& options, Mesh& high,
                      std::vector<Warning>& warnings) {
  if (arguments.alpha_test <= 0) return;
  if (!options.opacity) {
    throw Error(ErrorCode::input, "--alpha-test: " + in_words(high_files(arguments)) +
                                      " names no materials: give the picture, --transfer "
                                      "FILE:opacity.");
  }
  CutOutReport report;
  high = cut_out(high, *options.opacity, arguments.alpha_test, &report);
  if (report.cut + report.gone != 0) return;
  warnings.push_back({"alpha-test-idle",
                      "--alpha-test found nothing of " + in_words(high_files(arguments)) +
                          " that is transparent: see whether its pictures have an alpha channel.",
                      1});
}

}  // namespace kiln::cli
