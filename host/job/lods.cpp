// Bakes a chain of low polys, one per size on screen.
#include <algorithm>
#include <optional>
#include <utility>

#include "job/stages.h"
#include "kiln/files.h"
#include "kiln/plan.h"
#include "kiln/version.h"
#include "options/json.h"
#include "options/parse.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// Describes a level for NAME_lods.json. \param files  all files written for it, the mesh first
Json level_json(const LodLevel& level, std::size_t number, const std::vector<std::string>& files) {
  const Candidate& chosen = level.plan.chosen;
  Json json = {{"level", number},
               {"screen", level.screen},
               {"mesh", fs::path(files.front()).filename().string()},
               {"maps", Json::array()},
               {"maps_of_level", chosen.size == 0 ? Json() : Json(level.own_maps ? number : 0)},
               {"faces", chosen.faces},
               {"positions", chosen.positions},
               {"vertices", chosen.vertices},
               {"size", chosen.size},
               {"bits", chosen.bits},
               {"match", chosen.method.name},
               {"bytes",
                {{"vertices", chosen.bytes.vertices},
                 {"texels", chosen.bytes.texels},
                 {"total", chosen.bytes.total()}}},
               {"measured_degrees", chosen.measured},
               {"standard_error_degrees", chosen.standard_error},
               {"one_sided_share", chosen.silhouette_mismatch},
               {"wanted_degrees", level.plan.wanted},
               {"reached", level.plan.reached}};
  for (std::size_t i = 1; i < files.size(); ++i) {
    json["maps"].push_back(fs::path(files[i]).filename().string());
  }
  return json;
}

/// Adds a level to PlannedLow::lod_descriptions. \param coverage  see lod_coverages(); for levels in one file
void describe_level(const StoredMaps& stored, PlannedLow& planned, std::size_t number,
                    const std::vector<std::string>& files, std::optional<double> coverage = {}) {
  const LodLevel& level = planned.lods->levels[number];
  Json json = level_json(level, number, files);
  if (!stored.ranges.empty()) json["ranges"] = stored.ranges;
  if (!stored.mips.empty()) json["mips"] = stored.mips;
  if (!stored.errors.empty()) json["stored_errors"] = stored.errors;
  if (number > 0 && !level.own_maps) json["maps"] = planned.lod_descriptions[0]["maps"];
  if (coverage) json["coverage"] = *coverage;
  planned.lod_descriptions.push_back(std::move(json));
}

/// Writes one level. \param scene  a scene whose low poly is that of the level
/// \param file  the asset to write
void save_level(const BakeScene& scene, const Source& source, const std::string& file,
                PlannedLow& planned, std::size_t number, BakedLayout& baked, AssetParts& asset,
                JobOutputs& outputs) {
  const std::size_t first_output = outputs.files.size();
  save_low_and_maps(scene, source, file, &planned, baked, asset, outputs);
  const std::vector<std::string> files(
      outputs.files.begin() + static_cast<std::ptrdiff_t>(first_output), outputs.files.end());
  describe_level(baked.stored, planned, number, files);
}

/// A level after the first, moved out of the chain.
struct CoarserLevel {
  LowMesh low;
  BakedLayout baked;
  AssetParts asset;
};

CoarserLevel extract_level(const Job& job, LodLevel& level, std::size_t number,
                           const BakedLayout& first, const AssetParts& first_asset) {
  LowPolyPlan& plan = level.plan;
  CoarserLevel coarser_level;
  coarser_level.low.mesh = std::move(plan.low);
  coarser_level.low.stem = coarser_level.low.mesh.name = lod_stem(job, number);
  coarser_level.low.made = true;
  coarser_level.baked.options = first.options;
  if (plan.result) coarser_level.baked.result = std::move(*plan.result);
  if (!level.own_maps) coarser_level.asset.pictures = first_asset.pictures;
  coarser_level.asset.has_opacity = first_asset.has_opacity;
  coarser_level.asset.opacity_is_sampled = first_asset.opacity_is_sampled;
  return coarser_level;
}

/// Writes all levels into one GLB or glTF.
void save_joined_levels(const BakeScene& scene, const Source& source, PlannedLow& planned,
                        BakedLayout& first, AssetParts& asset, JobOutputs& outputs) {
  const Job& job = scene.run.job;
  LodChain& chain = *planned.lods;
  encode_asset_maps(scene, source, &planned, first, asset);
  std::vector<AssetLevel> levels;
  std::vector<StoredMaps> stored = {first.stored};
  const std::vector<double> coverages = lod_coverages(chain);
  for (std::size_t k = 1; k < chain.levels.size(); ++k) {
    CoarserLevel level = extract_level(job, chain.levels[k], k, first, asset);
    const BakeScene level_scene{scene.run, scene.high, level.low};
    if (level.asset.pictures.empty()) {
      encode_asset_maps(level_scene, source, &planned, level.baked, level.asset);
    }
    levels.push_back(make_asset_level(level_scene, level.asset, k));
    levels.back().coverage = coverages[k];
    // All levels use one name, so that levels with the same pictures share a material.
    for (AssetMaterial& material : levels.back().materials) {
      if (material.name == level.low.mesh.name) material.name = scene.low.mesh.name;
    }
    stored.push_back(level.baked.stored);
    first.stored.copy_shared_properties(level.baked.stored);
  }
  const std::string file = asset_file(job);
  write_asset(scene, file, asset_extras(scene, first.result.report, first.stored.errors, {}), asset,
              outputs, std::move(levels));
  for (std::size_t k = 0; k < stored.size(); ++k) {
    describe_level(stored[k], planned, k, {file}, coverages[k]);
  }
}

}  // namespace

std::vector<double> lod_coverages(const LodChain& chain) {
  constexpr std::uint32_t kViewHeight = 1080;
  const auto height = static_cast<double>(std::max(kViewHeight, chain.levels.front().screen));
  std::vector<double> coverages = {1};
  for (std::size_t k = 1; k < chain.levels.size(); ++k) {
    const LowPolyPlan& plan = chain.levels[k].plan;
    const double measured = plan.chosen.measured;
    const double share = measured > plan.wanted ? plan.wanted / measured : 1;
    coverages.push_back(std::min(coverages.back(), share * chain.levels[k].screen / height));
  }
  return coverages;
}

std::string lods_file(const Job& job) {
  const fs::path named = asset_file(job).empty() ? high_name(job) : asset_file(job);
  return named.stem().string() + "_lods.json";
}

std::string lod_asset(const Job& job, std::size_t level) {
  const fs::path first = asset_file(job);
  return (first.parent_path() / (lod_stem(job, level) + first.extension().string())).string();
}

PlannedLow make_lods(const BakeScene& scene, const Source& source, const BakeOptions& bake) {
  const Job& job = scene.run.job;
  RunLog& log = scene.run.log;
  LodOptions options;
  options.plan = low_poly_options(scene, bake);
  forward_plan_to_hook(scene, options.plan);
  options.levels = job.low.make.lods;
  options.error_growth = job.low.make.lod_growth;
  options.share_uvs = shares_uvs(job);
  PlannedLow planned;
  planned.lods = bake_lods(source, scene.high.mesh(), options);
  LodChain& chain = *planned.lods;
  if (chain.cancelled) throw Cancelled{};
  for (const LodLevel& level : chain.levels) {
    const LowPolyPlan& plan = level.plan;
    const std::string place_text = " at " + std::to_string(level.screen) + " pixels";
    if (!plan.reached) log.warnings.push_back(plan_bound_warning(plan, place_text));
    warn_of_outline(plan, place_text, log.warnings);
    // the caller reports the warnings of the first level
    if (&level == &chain.levels.front()) continue;
    log.warn(plan.simplified.warnings);
    if (plan.unwrapped) log.warn(plan.unwrapped->warnings);
  }
  planned.plan = chain.levels.front().plan;
  chain.levels.front().plan.result.reset();
  return planned;
}

void save_lods(const BakeScene& scene, const Source& source, PlannedLow& planned,
               BakedLayout& first, AssetParts& asset, JobOutputs& outputs) {
  const Job& job = scene.run.job;
  LodChain& chain = *planned.lods;
  if (writes_lods_into_one_file(job)) {
    save_joined_levels(scene, source, planned, first, asset, outputs);
    if (job.in_memory) return;
  } else {
    save_level(scene, source, asset_file(job), planned, 0, first, asset, outputs);
    for (std::size_t k = 1; k < chain.levels.size(); ++k) {
      CoarserLevel level = extract_level(job, chain.levels[k], k, first, asset);
      const std::string file = writes_gltf(job) ? lod_asset(job, k) : asset_file(job);
      save_level({scene.run, scene.high, level.low}, source, file, planned, k, level.baked,
                 level.asset, outputs);
      first.stored.copy_shared_properties(level.baked.stored);
    }
  }
  const fs::path path = fs::path(out_folder(job)) / lods_file(job);
  outputs.files.push_back(path.string());
  save_text(path, to_text({{"version", version()}, {"levels", planned.lod_descriptions}}));
}

std::vector<std::string> lod_table(const LodChain& chain) {
  std::string text = formatted("%9s %9s %9s %9s %12s %10s %10s", "level", "from px", "faces",
                               "vertices", "map", "KiB", "measured");
  std::vector<std::string> lines = {text};
  for (std::size_t k = 0; k < chain.levels.size(); ++k) {
    const LodLevel& level = chain.levels[k];
    const Candidate& chosen = level.plan.chosen;
    const std::string size = std::to_string(chosen.size);
    const std::string map = chosen.size == 0  ? "none"
                            : !level.own_maps ? "that of 0"
                                              : size + " x " + size;
    text = formatted("%9zu %9u %9s %9s %12s %10.1f %10.3g ± %.2g", k, level.screen,
                     with_commas(chosen.faces).c_str(), with_commas(chosen.vertices).c_str(),
                     map.c_str(), static_cast<double>(chosen.bytes.total()) / 1024, chosen.measured,
                     chosen.standard_error);
    lines.emplace_back(text);
  }
  return lines;
}

}  // namespace kiln
