// Writes the files of a bake: maps, packed images, meshes, and the match.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <set>

#include "asset/saved_mesh.h"
#include "image/mip_padding.h"
#include "image/stored_values.h"
#include "io/file/placing.h"
#include "job/files.h"
#include "job/map_file.h"
#include "job/map_words.h"
#include "job/match_inputs.h"
#include "job/mesh_files.h"
#include "job/stages.h"
#include "job/transfers.h"
#include "kiln/image.h"
#include "options/parse.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReasonsName = "reasons";
constexpr const char* kClustersName = "clusters";
constexpr const char* kLayersName = "layers";

/// Path of a file beside the maps: STEM_WHAT.TILE and the extension.
fs::path path_beside_maps(const Job& job, const SetNames& names, const std::string& what,
                          const char* extension) {
  return fs::path(out_folder(job)) / (names.stem + "_" + what + names.tile + extension);
}

/// Name of a map of one cluster of visibility directions.
std::string cluster_name(const std::string& map, std::uint32_t cluster) {
  return cluster == 0 ? map : map + "_" + std::to_string(cluster);
}

bool has_clusters(const std::string& map) {
  return std::none_of(maps().begin(), maps().end(), [&](const MapInfo& info) {
    return info.kind.name == map && info.type == MapType::coverage;
  });
}

/// Describes the mip levels of a map, with the file of each.
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

SetNames BakeScene::names() const {
  return set != nullptr ? names_of(run.job, *set) : SetNames{low.stem, "", ""};
}

void StoredMaps::copy_shared_properties(const StoredMaps& other) {
  variant_ids.update(other.variant_ids);
  if (other.origin) origin = other.origin;
}

void drop_unwritten_maps(const RunHooks& hooks, BakedLayout& baked) {
  std::erase_if(baked.result.maps, [&](const BakedMap& map) {
    return hooks.not_written.contains(std::string(map.kind.name)) ||
           (baked.has_only_sampled_images && map.kind == shading_map());
  });
}

void register_output(const RunContext& run, const fs::path& path, JobOutputs& outputs) {
  if (run.job.in_memory) return run.log.progress(kProgressAtSave, "encoding");
  outputs.files.push_back(path.string());
  run.log.progress(kProgressAtSave, "writing " + path.string());
}

bool chooses_padding(const Job& job) {
  return job.given.contains("--gutter") ||
         job.bake.encoding.gutter != BakeOptions().encoding.gutter;
}

bool pads_for_mips(const Job& job) {
  return writes_gltf(job) || (!chooses_padding(job) && (job.low.given.empty() || job.unwrap));
}

namespace {

/// Writes an image with its mip levels.
void save_with_mips(const BakeScene& scene, const BakedMap& map, const std::string& name,
                    TextureUse use, std::vector<ImageText> texts, BakedLayout& baked,
                    JobOutputs& outputs) {
  SaveImageOptions options = scene.run.job.image;
  options.use = use;
  options.origin = map.origin;
  options.texts = std::move(texts);
  const SetNames names = scene.names();
  const std::vector<fs::path> files = map_files(
      out_folder(scene.run.job), names.stem + "_" + name + names.tile, map.mips.size(), options);
  for (std::size_t level = 0; level < files.size(); ++level) {
    register_output(scene.run, files[level], outputs);
    if (!map.mips.empty() && stores_mips_in_one_file(options)) {
      save_mipmapped(map.image, map.mips, files[level], options);
    } else {
      save_image(level == 0 ? map.image : map.mips[level - 1], files[level], options);
    }
  }
  if (baked.options.encoding.mips) baked.stored.mips[name] = describe_levels(map, files);
}

/// Writes the packed images of --pack.
void save_packs(const BakeScene& scene, BakedLayout& baked, JobOutputs& outputs) {
  const SaveImageOptions& image = scene.run.job.image;
  for (const Pack& pack : parse_packs(scene.run.job)) {
    const auto map_of = [&](const std::string& name) -> const BakedMap& {
      return *std::find_if(
          baked.result.maps.begin(), baked.result.maps.end(),
          [&](const BakedMap& map) { return map.kind.name == name && map.cluster == 0; });
    };
    BakedMap joined;
    joined.image = pack_channels(
        pack, [&](const std::string& map) -> const Image& { return map_of(map).image; });
    std::size_t levels = 64;  // more mip levels than any image has
    std::vector<ValueRange> ranges;
    std::string units;
    bool has_units = false;
    for (const PackChannel& channel : pack.channels) {
      ranges.push_back({0, 1});
      if (&channel != pack.channels.data()) units += ", ";
      if (channel.map.empty()) {
        units += "1";
        continue;
      }
      const BakedMap& map = map_of(channel.map);
      const std::vector<ValueRange> range = stored_ranges(map, image.format);
      if (!range.empty()) ranges.back() = range[channel.channel];
      has_units = has_units || !map.unit.empty();
      units += map.unit.empty() ? "1" : map.unit;
      levels = std::min(levels, map.mips.size());
      // all maps of positions have the same origin
      if (obeys(map.info, "encoding.origin")) joined.origin = map.origin;
    }
    for (std::size_t level = 0; level < levels; ++level) {
      joined.mips.push_back(pack_channels(
          pack, [&](const std::string& map) -> const Image& { return map_of(map).mips[level]; }));
    }
    if (holds_floats(image) || !has_units) ranges.clear();
    const std::vector<ImageText> texts =
        value_texts(image, ranges, has_units ? units : std::string());
    const bool is_color =
        std::any_of(pack.channels.begin(), pack.channels.end(), [&](const PackChannel& channel) {
          return !channel.map.empty() && map_of(channel.map).info.type == MapType::color;
        });
    const TextureUse use = is_color ? TextureUse::color : TextureUse::values;
    save_with_mips(scene, joined, pack.name, use, texts, baked, outputs);
  }
}

/// Writes all maps, each to a file, or as layers of one file.
void save_maps(const BakeScene& scene, BakedLayout& baked, JobOutputs& outputs) {
  const Job& job = scene.run.job;
  std::vector<ImageLayer> layers;
  for (BakedMap& map : baked.result.maps) {
    const std::string name = cluster_name(std::string(map.kind.name), map.cluster);
    if (MapFile* const file = baked.file_of(map)) {
      finish_map_file(scene, map, name, *file, baked, outputs);
      continue;
    }
    convert_to_stored(scene, map, name, baked);
    const std::vector<ImageText> texts =
        value_texts(job.image, stored_ranges(map, job.image.format), std::string(map.unit));
    if (job.layers) {
      layers.push_back({name, &map.image, map.origin, texts});
    } else {
      save_with_mips(scene, map, name, texture_use(map, baked.options), texts, baked, outputs);
    }
  }
  if (!layers.empty()) {
    const fs::path path = path_beside_maps(job, scene.names(), kLayersName, ".exr");
    register_output(scene.run, path, outputs);
    save_layers(layers, path, job.image);
  }
  save_packs(scene, baked, outputs);
}

/// Appends the paths of all files of one layout's maps.
void add_map_outputs(const Job& job, const SetNames& names, std::vector<fs::path>& outputs) {
  const auto& [stem, tile, match] = names;
  const fs::path folder = out_folder(job);
  for (const Pack& pack : parse_packs(job)) {
    outputs.push_back(folder / (stem + "_" + pack.name + tile + extension(job.image)));
  }
  if (job.layers) outputs.push_back(path_beside_maps(job, names, kLayersName, ".exr"));
  for (const std::string& map : job.layers ? std::vector<std::string>() : all_map_names(job)) {
    outputs.push_back(folder / (stem + "_" + map + tile + extension(job.image)));
    for (std::uint32_t k = 1; k < job.bake.match.visibility.clusters && has_clusters(map); ++k) {
      outputs.push_back(folder / (stem + "_" + cluster_name(map, k) + tile + extension(job.image)));
    }
  }
  if (job.bake.match.visibility.clusters > 1)
    outputs.push_back(path_beside_maps(job, names, kClustersName, ".exr"));
  if (job.reasons) outputs.push_back(path_beside_maps(job, names, kReasonsName, ".png"));
  if (!job.save_match.empty()) {
    outputs.emplace_back(match_file(job.save_match, names));
  }
}

}  // namespace

SetNames names_of(const Job& job, const BakedSet& set) {
  const std::string stem = low_stem(job);
  if (job.sets == SetsBy::udim) return {stem, "." + set.word, "." + set.word};
  const std::string tile = set.set.tile.empty() ? "" : "." + set.set.tile;
  return {stem + "_" + set.word, tile, "_" + set.word + tile};
}

std::string match_file(const std::string& path, const SetNames& names) {
  const fs::path file = path;
  return (file.parent_path() / (file.stem().string() + names.match + file.extension().string()))
      .string();
}

void check_outputs(const Job& job, std::span<const BakedSet> sets, const RunHooks& hooks) {
  if (job.in_memory) return;
  const fs::path folder = out_folder(job);
  refuse_if(folder.empty(), option("out") + " is empty: give a folder.");
  refuse_if(!job.save_match.empty() && fs::path(job.save_match).extension() != ".exr",
            option("save_match") + " '" + job.save_match +
                "': a match is an EXR, so the name must end in .exr.");
  refuse_if(!job.save_source.empty() && !is_saved_source_name(job.save_source),
            option("save_source") + " '" + job.save_source +
                "': a saved source has its own format, so the name must end in .kilnsrc.");
  const std::string cage = fs::path(job.save_cage).extension().string();
  refuse_if(!job.save_cage.empty() && cage != ".obj" && cage != ".exr",
            option("save_cage") + " '" + job.save_cage +
                "': a cage is an OBJ or an EXR, so the name must end in .obj or .exr.");
  const bool makes_low = writes_low(job);
  const std::string stem = low_stem(job);
  std::vector<std::string> file_stems = {stem};
  const std::uint32_t files_of_lods = writes_lods_into_one_file(job) ? 1 : job.low.make.lods;
  for (std::uint32_t k = 1; k < files_of_lods; ++k) file_stems.push_back(lod_stem(job, k));
  std::vector<fs::path> outputs = {job.json, job.save_cage, job.save_source};
  if (writes_gltf(job)) {
    std::vector<fs::path> files = {asset_file(job)};
    for (std::uint32_t k = 1; k < files_of_lods; ++k) files.emplace_back(lod_asset(job, k));
    for (fs::path& file : files) {
      outputs.push_back(file);
      outputs.push_back(file.replace_extension(".bin"));
    }
    file_stems.clear();
  } else if (!asset_file(job).empty()) {
    outputs.push_back(fs::path(asset_file(job)).replace_extension(".mtl"));
    check_obj_is_replaceable(outputs.back(), job.force);
  }
  for (const std::string& name : file_stems) {
    if (makes_low) outputs.push_back(folder / (name + ".obj"));
    if (sets.empty() && (name == stem || !shares_uvs(job))) {
      add_map_outputs(job, {name, "", ""}, outputs);
    }
  }
  for (const BakedSet& set : sets) {
    const SetNames names = names_of(job, set);
    add_map_outputs(job, names, outputs);
    if (!job.force) check_folder_holds_same_low(folder, names.stem, low_source(job));
  }
  if (job.low.make.lods > 0) outputs.push_back(folder / lods_file(job));
  std::vector<fs::path> inputs = {job.cage_mesh, job.match_list};
  if (sets.empty()) inputs.emplace_back(job.load_match);
  for (const BakedSet& set : job.load_match.empty() ? std::span<const BakedSet>() : sets) {
    inputs.emplace_back(match_file(job.load_match, names_of(job, set)));
  }
  for (const auto* side : {&job.high, &job.low.given}) {
    for (const JobInput& input : *side) {
      if (!input.asset) inputs.emplace_back(input.name);
    }
  }
  for (const std::string& file : job.occluders) inputs.emplace_back(file);
  for (const TransferArgument& transfer : parse_transfers(job)) {
    inputs.emplace_back(transfer.file);
  }
  if (plans_low_poly(job) && hooks.plan_files) {
    for (const std::string& file : hooks.plan_files(stem)) outputs.push_back(folder / file);
  }
  check_paths(inputs, outputs);
  // Checked before the bake, which may take hours.
  for (const fs::path& output : outputs) {
    if (!is_write_protected(output)) continue;
    fail_to_write(output, "the file there is write-protected", EACCES);
  }
  for (const std::string& name : file_stems) {
    if (makes_low) check_obj_is_replaceable(folder / (name + ".obj"), job.force);
    if (!job.force) check_folder_holds_same_low(folder, name, low_source(job));
  }
}

namespace {

/// Draws the reason of each texel in the colour of its ReasonInfo.
Image reasons_image(const Reasons& reasons) {
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

void save_low_and_maps(const BakeScene& scene, const Source& source, const std::string& file,
                       const PlannedLow* planned, BakedLayout& baked, AssetParts& asset,
                       JobOutputs& outputs) {
  const RunContext& run = scene.run;
  const Job& job = run.job;
  const LowMesh& low = scene.low;
  if (job.in_memory && !writes_gltf(job)) {
    for (BakedMap& map : baked.result.maps) {
      const std::string name = cluster_name(std::string(map.kind.name), map.cluster);
      convert_to_stored(scene, map, name, baked);
      const TextureSet set = scene.set != nullptr ? scene.set->set : TextureSet();
      outputs.maps.push_back({name, set.name, set.tile, std::move(map)});
    }
    return run.log.progress(kProgressAtSave, "encoding");
  }
  if (writes_gltf(job)) {
    if (asset.pictures.empty() || !baked.result.maps.empty()) {
      encode_asset_maps(scene, source, planned, baked, asset);
    }
    if (!scene.sets.empty()) return;
    write_asset(scene, file, asset_extras(scene, baked.result.report, baked.stored.errors, {}),
                asset, outputs);
    return;
  }
  const fs::path folder = out_folder(job);
  if (!file.empty()) {
    find_materials_hit(scene, baked.result, asset);
    if (scene.sets.empty()) write_obj_with_mtl(scene, asset, outputs);
  } else if (low.made) {
    const fs::path path = folder / (low.stem + ".obj");
    register_output(run, path, outputs);
    Mesh written = join_collision_hulls(low.mesh, low.hulls);
    move_material_files(written, fs::path(low_source(job)).parent_path(), folder);
    save_obj(written, path);
  }
  if (!baked.result.maps.empty()) save_maps(scene, baked, outputs);
  if (baked.result.clusters) {
    const fs::path path = path_beside_maps(job, scene.names(), kClustersName, ".exr");
    register_output(run, path, outputs);
    save_clusters(*baked.result.clusters, path);
  }
  for (const std::string& stem : std::set{low.stem, scene.names().stem}) {
    save_low_record(folder, stem, low_source(job));
  }
}

void save_found_cage(const BakeScene& scene, const MatchInputs& inputs, JobOutputs& outputs) {
  const std::string& path = scene.run.job.save_cage;
  if (path.empty()) return;
  register_output(scene.run, path, outputs);
  save_cage(*inputs.cage_mesh(), scene.low.mesh, path);
}

void save_beside_maps(const BakeScene& scene, const BakedLayout& baked, JobOutputs& outputs) {
  const Job& job = scene.run.job;
  if (baked.reasons) {
    const fs::path path = path_beside_maps(job, scene.names(), kReasonsName, ".png");
    register_output(scene.run, path, outputs);
    save_image(reasons_image(*baked.reasons), path, {ImageFormat::png8});
  }
  if (job.save_match.empty()) return;
  const std::string path = match_file(job.save_match, scene.names());
  register_output(scene.run, path, outputs);
  save_match(*baked.result.match, path);
}

}  // namespace kiln
