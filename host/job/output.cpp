// The files of a bake.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>

#include "image/mip_padding.h"
#include "job/files.h"
#include "job/map_file.h"
#include "job/map_words.h"
#include "job/match_inputs.h"
#include "job/mesh_files.h"
#include "job/run.h"
#include "job/transfers.h"
#include "options/parse.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReasons = "reasons";
constexpr const char* kClusters = "clusters";
constexpr const char* kLayers = "layers";

/// A file beside the maps.
fs::path beside(const Job& arguments, const SetNames& names, const std::string& what,
                const char* extension) {
  return fs::path(out_folder(arguments)) / (names.stem + "_" + what + names.tile + extension);
}

/// File of a map for one of several clusters of directions.
std::string cluster_name(const std::string& map, std::uint32_t cluster) {
  return cluster == 0 ? map : map + "_" + std::to_string(cluster);
}

bool writes_low(const Job& arguments) {
  return arguments.low.given.empty() || arguments.unwrap || arguments.split_at_seams ||
         !asset_file(arguments).empty();
}

bool has_clusters(const std::string& map) {
  return std::none_of(maps().begin(), maps().end(), [&](const MapInfo& info) {
    return info.kind.name == map && info.type == MapType::coverage;
  });
}

/// Integer formats clamp what lies beyond the range.
void warn_of_clamped(BakeRun& run, const BakedMap& map, const std::string& name) {
  const RangeExcess excess = beyond_range(map, run.result.coverage);
  if (holds_floats(run.save_options) || excess.texels == 0) return;
  const std::string example =
      formatted("%.6g at texel column %u, row %u", double{excess.value}, excess.x, excess.y);
  run.warnings.push_back({"beyond-range",
                          with_commas(excess.texels) + " texels of the map " + name +
                              " lie beyond its range and are clamped, for example " + example +
                              ": give " + option("range", std::string(map.kind.name) + "=LO,HI") +
                              " that holds them, or " + option("format", "exr") +
                              ", which holds values as they are.",
                          excess.texels});
}

Json range_json(const std::vector<ValueRange>& ranges) {
  Json json = Json::array();
  for (const auto [low, high] : ranges) json.push_back({low, high});
  return json;
}

/// The levels of a map's mip-map, and the file that each is in.
Json describe_levels(const BakedMap& map, const std::vector<fs::path>& files) {
  Json levels = Json::array();
  for (std::size_t level = 0; level <= map.mips.size(); ++level) {
    const Image& image = level == 0 ? map.image : map.mips[level - 1];
    levels.push_back({{"level", level},
                      {"width", image.width},
                      {"height", image.height},
                      {"file", files[std::min(level, files.size() - 1)].string()}});
  }
  return levels;
}

}  // namespace

bool announce(BakeRun& run, const fs::path& path) {
  if (run.arguments.in_memory) return run.console.progress(kAtSave, "encoding");
  run.outputs.push_back(path.string());
  return run.console.progress(kAtSave, "writing " + path.string());
}

namespace {

/// A texel's side on the low poly, world units, in the mean.
double texel_side(const BakeRun& run) {
  const Mesh& low = run.low.mesh;
  double area = 0;
  for (std::size_t i = 0; i < low.triangles.size(); ++i) {
    const Triangle& t = low.triangles[i];
    if (!std::isfinite(low.uvs[low.uv_triangles[i][0]].x)) continue;  // of another texture set
    std::array<std::array<double, 3>, 2> side{};
    const Vec3 &a = low.positions[t[0]], &b = low.positions[t[1]], &c = low.positions[t[2]];
    side[0] = {double{b.x} - a.x, double{b.y} - a.y, double{b.z} - a.z};
    side[1] = {double{c.x} - a.x, double{c.y} - a.y, double{c.z} - a.z};
    const auto& [u, v] = side;
    const double doubled =
        std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
    if (std::isfinite(doubled)) area += doubled / 2;
  }
  const double texels = static_cast<double>(std::max<std::uint64_t>(1, run.result.report.texels));
  return std::sqrt(area / texels);
}

/// Says so where files of the format hold a map's values too coarsely, or not at all.
/// \param ranges  of integers; else none
void warn_of_format(BakeRun& run, const BakedMap& map, const std::string& name,
                    const std::vector<ValueRange>& ranges) {
  constexpr float kMostHalf = 65520,
                  kLeastHalf = 0x1p-14F;  // from here on infinite; full precision
  constexpr int kHalfBits = 10, kFloatBits = 23, kLastHalfBit = -24;
  const ImageFormat format = run.save_options.format;
  const bool half = format == ImageFormat::exr_half;
  if (map.info.low != 0 || map.info.high != 0) return;
  float most = 0;
  for (std::size_t i = 0; i < map.image.pixels.size(); ++i) {
    const auto state = TexelState{run.result.coverage[i / map.image.channels]};
    const float value = std::abs(map.image.pixels[i]);
    if (state == TexelState::baked && std::isfinite(value)) most = std::max(most, value);
  }
  if (most == 0) return;
  const auto warn = [&](const char* code, const std::string& what) {
    run.warnings.push_back(
        {code,
         "The map " + name + " " + what +
             (format == ImageFormat::exr_float || format == ImageFormat::tiff_float
                  ? "Give a nearer " + option("origin") + ", or none."
                  : "Use " + option("format", "exr32") + "."),
         1});
  };
  const auto number = [](double value) { return formatted("%.3g", value); };
  if (half && most >= kMostHalf) {
    return warn("map-overflow",
                "reaches " + number(double{most}) +
                    ", but half precision ends at 65504: such texels are infinite. ");
  }
  if (half && most < kLeastHalf) {
    return warn("map-steps", "has values of at most " + number(double{most}) +
                                 ", which half precision holds in steps of " +
                                 number(std::exp2(kLastHalfBit)) + ". ");
  }
  const bool places = obeys(map.info, "encoding.origin") &&
                      std::any_of(maps().begin(), maps().end(),
                                  [&](const MapInfo& info) { return info.kind == map.kind; });
  if (!places) return;
  double step = std::exp2(std::ilogb(most) - (half ? kHalfBits : kFloatBits));
  if (!holds_floats(run.save_options)) {
    step = 0;
    for (const auto [low, high] : ranges) {
      step = std::max(step, (double{high} - low) / (holds_bytes(run.save_options) ? 255 : 65535));
    }
  }
  const double texel = texel_side(run);
  if (step > texel) {
    warn("map-steps", "is stored in steps of " + number(step) + ", but its texels are " +
                          number(texel) + " apart. ");
  }
}

}  // namespace

bool pads_for_mips(const BakeRun& run) {
  const bool chosen = run.arguments.given.contains("--gutter") ||
                      run.options.encoding.gutter != BakeOptions().encoding.gutter;
  return !chosen && (writes_gltf(run.arguments) || run.low.made);
}

/// The same of one map. Ids have no mean, and maps with levels of their own need none.
bool pads_for_mips(const BakeRun& run, const BakedMap& map) {
  return map.info.type != MapType::id && map.info.type != MapType::coverage && map.mips.empty() &&
         pads_for_mips(run);
}

void store(BakeRun& run, BakedMap& map, const std::string& name) {
  const SaveImageOptions& options = run.save_options;
  warn_of_clamped(run, map, name);
  if (map.info.type == MapType::color && !holds_floats(options)) {
    to_srgb(map.image);
    for (Image& level : map.mips) to_srgb(level);
  }
  if (obeys(map.info, "encoding.origin")) run.origin = map.origin;
  const auto is_this = [&](const MapVariant& variant) { return variant.name == map.kind.name; };
  if (!map.ids.empty() &&
      std::any_of(run.options.variants.begin(), run.options.variants.end(), is_this)) {
    run.variant_ids[name] = ids_json(map.ids);
  }
  const std::vector<ValueRange> range = stored_ranges(map, options);
  warn_of_format(run, map, name, range);
  if (!range.empty()) {
    store_in(range, map.image);
    for (Image& level : map.mips) store_in(range, level);
    run.ranges[name] = range_json(range);
  }
  if (pads_for_mips(run, map)) pad_for_mips(map.image, run.result.coverage);
  if (!holds_bytes(options) || writes_gltf(run.arguments)) return;
  SaveImageOptions stored = options;
  stored.use = texture_use(map, run.options);
  run.stored_errors[name] =
      describe(stored_error(map.image, stored, run.result.coverage),
               stored.use == TextureUse::normal || stored.use == TextureUse::tangent_normal);
}

namespace {

/// An image with its mip chain. \returns false where it was cancelled
bool save_with_mips(BakeRun& run, const BakedMap& map, const std::string& name, TextureUse use,
                    std::vector<ImageText> texts) {
  SaveImageOptions options = run.save_options;
  options.use = use;
  options.origin = map.origin;
  options.texts = std::move(texts);
  const SetNames names = names_of(run);
  const std::vector<fs::path> files = map_files(
      out_folder(run.arguments), names.stem + "_" + name + names.tile, map.mips.size(), options);
  for (std::size_t level = 0; level < files.size(); ++level) {
    if (!announce(run, files[level])) return false;
    if (!map.mips.empty() && holds_mips(options)) {
      save_mipmapped(map.image, map.mips, files[level], options);
    } else {
      save_image(level == 0 ? map.image : map.mips[level - 1], files[level], options);
    }
  }
  if (run.options.encoding.mips) run.mips[name] = describe_levels(map, files);
  return true;
}

/// The maps' channels in other files. \returns false where it was cancelled
bool save_packs(BakeRun& run) {
  for (const Pack& pack : parse_packs(run.arguments)) {
    const auto map_of = [&](const std::string& name) -> const BakedMap& {
      return *std::find_if(
          run.result.maps.begin(), run.result.maps.end(),
          [&](const BakedMap& map) { return map.kind.name == name && map.cluster == 0; });
    };
    BakedMap joined;
    joined.image =
        packed(pack, [&](const std::string& map) -> const Image& { return map_of(map).image; });
    std::size_t levels = 64;  // more than there are
    std::vector<ValueRange> ranges;
    std::string units;
    bool scaled = false;
    for (const PackChannel& channel : pack.channels) {
      ranges.push_back({0, 1});
      if (&channel != pack.channels.data()) units += ", ";
      if (channel.map.empty()) {
        units += "1";
        continue;
      }
      const BakedMap& map = map_of(channel.map);
      const std::vector<ValueRange> range = stored_ranges(map, run.save_options);
      if (!range.empty()) ranges.back() = range[channel.channel];
      scaled = scaled || !map.unit.empty();
      units += map.unit.empty() ? "1" : map.unit;
      levels = std::min(levels, map.mips.size());
      if (obeys(map.info, "encoding.origin")) joined.origin = map.origin;  // the same in all
    }
    for (std::size_t level = 0; level < levels; ++level) {
      joined.mips.push_back(packed(
          pack, [&](const std::string& map) -> const Image& { return map_of(map).mips[level]; }));
    }
    if (holds_floats(run.save_options) || !scaled) ranges.clear();
    const std::vector<ImageText> texts =
        texts_of(run.save_options, ranges, scaled ? units : std::string());
    const bool is_color =
        std::any_of(pack.channels.begin(), pack.channels.end(), [&](const PackChannel& channel) {
          return !channel.map.empty() && map_of(channel.map).info.type == MapType::color;
        });
    const TextureUse use = is_color ? TextureUse::color : TextureUse::values;
    if (!save_with_mips(run, joined, pack.name, use, texts)) return false;
  }
  return true;
}

/// All maps: a file each, or one with a layer each. \returns false where it was cancelled
bool save_maps(BakeRun& run) {
  std::vector<ImageLayer> layers;
  for (BakedMap& map : run.result.maps) {
    const std::string name = cluster_name(std::string(map.kind.name), map.cluster);
    store(run, map, name);
    const std::vector<ImageText> texts =
        texts_of(run.save_options, stored_ranges(map, run.save_options), std::string(map.unit));
    if (run.arguments.layers) {
      layers.push_back({name, &map.image, map.origin, texts});
    } else if (!save_with_mips(run, map, name, texture_use(map, run.options), texts)) {
      return false;
    }
  }
  if (!layers.empty()) {
    const fs::path path = beside(run.arguments, names_of(run), kLayers, ".exr");
    if (!announce(run, path)) return false;
    save_layers(layers, path, run.save_options);
  }
  return save_packs(run);
}

/// Files of maps whose low poly has a name.
void add_map_outputs(const Job& arguments, const SaveImageOptions& save_options,
                     const SetNames& names, std::vector<fs::path>& outputs) {
  const auto& [stem, tile, match] = names;
  const fs::path folder = out_folder(arguments);
  for (const Pack& pack : parse_packs(arguments)) {
    outputs.push_back(folder / (stem + "_" + pack.name + tile + extension(save_options)));
  }
  if (arguments.layers) outputs.push_back(beside(arguments, names, kLayers, ".exr"));
  for (const std::string& map :
       arguments.layers ? std::vector<std::string>() : all_maps(arguments)) {
    outputs.push_back(folder / (stem + "_" + map + tile + extension(save_options)));
    for (std::uint32_t k = 1; k < arguments.bake.match.visibility.clusters && has_clusters(map);
         ++k) {
      outputs.push_back(folder /
                        (stem + "_" + cluster_name(map, k) + tile + extension(save_options)));
    }
  }
  if (arguments.bake.match.visibility.clusters > 1)
    outputs.push_back(beside(arguments, names, kClusters, ".exr"));
  if (arguments.reasons) outputs.push_back(beside(arguments, names, kReasons, ".png"));
  if (!arguments.save_match.empty()) {
    outputs.emplace_back(match_file(arguments.save_match, names));
  }
}

}  // namespace

SetNames names_of(const Job& arguments, const BakedSet& set) {
  const std::string stem = low_stem(arguments);
  if (arguments.sets == SetsBy::udim) return {stem, "." + set.word, "." + set.word};
  const std::string tile = set.set.tile.empty() ? "" : "." + set.set.tile;
  return {stem + "_" + set.word, tile, "_" + set.word + tile};
}

SetNames names_of(const BakeRun& run) {
  return run.set != nullptr ? names_of(run.arguments, *run.set) : SetNames{run.low.stem, "", ""};
}

std::string match_file(const std::string& path, const SetNames& names) {
  const fs::path file = path;
  return (file.parent_path() / (file.stem().string() + names.match + file.extension().string()))
      .string();
}

void check_outputs(const Job& arguments, const SaveImageOptions& save_options,
                   std::span<const BakedSet> sets, const RunHooks& hooks) {
  if (arguments.in_memory) return;
  const fs::path folder = out_folder(arguments);
  refuse_if(folder.empty(), option("out") + " is empty: give a folder.");
  refuse_if(!arguments.save_match.empty() && fs::path(arguments.save_match).extension() != ".exr",
            option("save_match") + " '" + arguments.save_match +
                "': a match is an EXR, so the name must end in .exr.");
  const std::string cage = fs::path(arguments.save_cage).extension().string();
  refuse_if(!arguments.save_cage.empty() && cage != ".obj" && cage != ".exr",
            option("save_cage") + " '" + arguments.save_cage +
                "': a cage is an OBJ or an EXR, so the name must end in .obj or .exr.");
  const bool makes_low = writes_low(arguments);
  const std::string stem = low_stem(arguments);
  std::vector<std::string> stems = {stem};
  for (std::uint32_t k = 1; k < arguments.low.make.lods; ++k)
    stems.push_back(lod_stem(arguments, k));
  std::vector<fs::path> outputs = {arguments.json, arguments.save_cage};
  if (writes_gltf(arguments)) {
    std::vector<fs::path> files = {asset_file(arguments)};
    for (std::uint32_t k = 1; k < arguments.low.make.lods; ++k)
      files.emplace_back(lod_asset(arguments, k));
    for (fs::path& file : files) {
      outputs.push_back(file);
      outputs.push_back(file.replace_extension(".bin"));
    }
    stems.clear();
  } else if (!asset_file(arguments).empty()) {
    outputs.push_back(fs::path(asset_file(arguments)).replace_extension(".mtl"));
    check_not_foreign(outputs.back(), arguments.force);
  }
  for (const std::string& name : stems) {
    if (makes_low) outputs.push_back(folder / (name + ".obj"));
    if (sets.empty() && (name == stem || !shares_uvs(arguments))) {
      add_map_outputs(arguments, save_options, {name, "", ""}, outputs);
    }
  }
  for (const BakedSet& set : sets) {
    const SetNames names = names_of(arguments, set);
    add_map_outputs(arguments, save_options, names, outputs);
    if (!arguments.force) check_low_record(folder, names.stem, low_source(arguments));
  }
  if (arguments.low.make.lods > 0) outputs.push_back(folder / lods_file(arguments));
  std::vector<fs::path> inputs = {arguments.cage_mesh, arguments.match_list};
  if (sets.empty()) inputs.emplace_back(arguments.load_match);
  for (const BakedSet& set : arguments.load_match.empty() ? std::span<const BakedSet>() : sets) {
    inputs.emplace_back(match_file(arguments.load_match, names_of(arguments, set)));
  }
  for (const auto* side : {&arguments.high, &arguments.low.given}) {
    for (const JobInput& input : *side) {
      if (!input.asset) inputs.emplace_back(input.name);
    }
  }
  for (const std::string& file : arguments.occluders) inputs.emplace_back(file);
  for (const TransferArgument& transfer : parse_transfers(arguments)) {
    inputs.emplace_back(transfer.file);
  }
  if (plans_low_poly(arguments) && hooks.plan_files) {
    for (const std::string& file : hooks.plan_files(stem)) outputs.push_back(folder / file);
  }
  check_paths(inputs, outputs);
  for (const std::string& name : stems) {
    if (makes_low) check_not_foreign(folder / (name + ".obj"), arguments.force);
    if (!arguments.force) check_low_record(folder, name, low_source(arguments));
  }
}

namespace {

/// A texel's reason as its colour.
Image picture_of(const Reasons& reasons) {
  const auto infos = reason_infos();
  Image image;
  image.width = reasons.width;
  image.height = reasons.height;
  image.channels = 3;
  image.pixels.reserve(3 * reasons.texels.size());
  for (const Reason reason : reasons.texels) {
    for (const std::uint8_t channel : infos[static_cast<std::size_t>(reason)].color) {
      image.pixels.push_back(static_cast<float>(channel) / 255.0F);
    }
  }
  return image;
}

}  // namespace

bool save_low_and_maps(BakeRun& run) {
  if (run.arguments.in_memory && !writes_gltf(run.arguments)) {
    for (BakedMap& map : run.result.maps) {
      const std::string name = cluster_name(std::string(map.kind.name), map.cluster);
      store(run, map, name);
      const bool of_set = run.set != nullptr;
      run.stored_maps.push_back(
          {name, of_set ? run.set->set.name : "", of_set ? run.set->set.tile : "", std::move(map)});
    }
    return run.console.progress(kAtSave, "encoding");
  }
  if (writes_gltf(run.arguments)) {
    if (run.pictures.empty() || !run.result.maps.empty()) encode_asset_maps(run);
    return !run.sets.empty() || save_asset(run);
  }
  const fs::path folder = out_folder(run.arguments);
  if (!asset_file(run.arguments).empty()) {
    note_materials_hit(run);
    if (run.sets.empty() && !save_obj_with_mtl(run)) return false;
  } else if (run.low.made) {
    const fs::path path = folder / (run.low.stem + ".obj");
    if (!announce(run, path)) return false;
    move_material_files(run.low.mesh, fs::path(low_source(run.arguments)).parent_path(), folder);
    save_obj(with_hulls(run.low.mesh, run.low.hulls), path);
  }
  if (!run.result.maps.empty() && !save_maps(run)) return false;
  if (run.result.clusters) {
    const fs::path path = beside(run.arguments, names_of(run), kClusters, ".exr");
    if (!announce(run, path)) return false;
    save_clusters(*run.result.clusters, path);
  }
  for (const std::string& stem : std::set{run.low.stem, names_of(run).stem}) {
    save_low_record(folder, stem, low_source(run.arguments));
  }
  return true;
}

bool save_found_cage(BakeRun& run) {
  if (run.arguments.save_cage.empty()) return true;
  if (!announce(run, run.arguments.save_cage)) return false;
  save_cage(run.cage->mesh, run.low.mesh, run.arguments.save_cage);
  return true;
}

bool save_beside_maps(BakeRun& run) {
  if (run.reasons) {
    const fs::path path = beside(run.arguments, names_of(run), kReasons, ".png");
    if (!announce(run, path)) return false;
    save_image(picture_of(*run.reasons), path, {ImageFormat::png8});
  }
  if (!run.arguments.save_match.empty()) {
    const std::string path = match_file(run.arguments.save_match, names_of(run));
    if (!announce(run, path)) return false;
    save_match(*run.result.match, path);
  }
  return true;
}

bool save_outputs(BakeRun& run) {
  return save_low_and_maps(run) && save_beside_maps(run) && save_found_cage(run);
}

}  // namespace kiln
