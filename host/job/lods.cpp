// A bake of several low polys, each for a size on screen.
#include <cstdio>
#include <utility>

#include "job/run.h"
#include "kiln/files.h"
#include "kiln/plan.h"
#include "options/json.h"
#include "options/parse.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// One level as programs read it. \param files  that were written for it, the mesh first
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

/// Writes one level: the run's mesh and maps. \returns false where it was cancelled
bool save_level(BakeRun& run, const LodLevel& level, std::size_t number) {
  const std::size_t before = run.outputs.size();
  if (!save_low_and_maps(run)) return false;
  const std::vector<std::string> files(run.outputs.begin() + static_cast<std::ptrdiff_t>(before),
                                       run.outputs.end());
  Json json = level_json(level, number, files);
  if (!run.ranges.empty()) json["ranges"] = run.ranges;
  if (!run.mips.empty()) json["mips"] = run.mips;
  if (!run.stored_errors.empty()) json["stored_errors"] = run.stored_errors;
  if (number > 0 && !level.own_maps) json["maps"] = run.lod_levels[0]["maps"];
  run.lod_levels.push_back(std::move(json));
  return true;
}

}  // namespace

std::string lods_file(const Job& arguments) {
  const fs::path named =
      asset_file(arguments).empty() ? high_name(arguments) : asset_file(arguments);
  return named.stem().string() + "_lods.json";
}

std::string lod_asset(const Job& arguments, std::size_t level) {
  const fs::path first = asset_file(arguments);
  return (first.parent_path() / (lod_stem(arguments, level) + first.extension().string())).string();
}

bool make_lods(BakeRun& run, const Source& source) {
  LodOptions options;
  options.plan = low_poly_options(run);
  watch_plan(run, options.plan);
  options.levels = run.arguments.low.make.lods;
  options.error_growth = run.arguments.low.make.lod_growth;
  options.share_uvs = shares_uvs(run.arguments);
  run.lods = bake_lods(source, run.high_mesh(), options);
  LodChain& chain = *run.lods;
  if (chain.cancelled) return false;
  take_plan(run, chain.levels.front().plan);
  chain.levels.front().plan.result.reset();
  for (const LodLevel& level : chain.levels) {
    const LowPolyPlan& plan = level.plan;
    const std::string place = " at " + std::to_string(level.screen) + " pixels";
    if (!plan.reached) run.warnings.push_back(plan_not_reached(plan, place));
    warn_of_outline(plan, place, run.warnings);
    if (&level == &chain.levels.front()) continue;  // The run's own warnings.
    for (const auto* list :
         {&plan.simplified.warnings, plan.unwrapped ? &plan.unwrapped->warnings : nullptr}) {
      if (list != nullptr) run.warnings.insert(run.warnings.end(), list->begin(), list->end());
    }
  }
  return true;
}

bool save_lods(BakeRun& run) {
  LodChain& chain = *run.lods;
  if (!save_level(run, chain.levels.front(), 0)) return false;
  for (std::size_t k = 1; k < chain.levels.size(); ++k) {
    LowPolyPlan& plan = chain.levels[k].plan;
    // The run's mesh and maps are those of the level while it is written.
    LowMesh low;
    low.mesh = std::move(plan.low);
    low.stem = low.mesh.name = lod_stem(run.arguments, k);
    low.made = true;
    BakeResult result;
    if (plan.result) result = std::move(*plan.result);
    std::string out = writes_gltf(run.arguments) ? lod_asset(run.arguments, k) : run.arguments.out;
    std::vector<std::shared_ptr<const AssetPictures>> pictures;
    if (!chain.levels[k].own_maps) pictures = run.pictures;
    std::vector<std::uint32_t> materials_hit;
    Json mips, ranges = Json::object(), stored_errors = Json::object();
    const auto swap = [&] {
      std::swap(run.low, low);
      std::swap(run.result, result);
      std::swap(run.arguments.out, out);
      std::swap(run.pictures, pictures);
      std::swap(run.materials_hit, materials_hit);
      std::swap(run.mips, mips);
      std::swap(run.ranges, ranges);
      std::swap(run.stored_errors, stored_errors);
    };
    swap();
    const bool saved = save_level(run, chain.levels[k], k);
    swap();
    if (!saved) return false;
  }
  const fs::path path = fs::path(out_folder(run.arguments)) / lods_file(run.arguments);
  run.outputs.push_back(path.string());
  save_text(path, to_text({{"version", version()}, {"levels", run.lod_levels}}));
  return true;
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
