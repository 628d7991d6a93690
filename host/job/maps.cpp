// Bakes the maps of one layout, and checks them.
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "base/percent.h"
#include "job/check_result.h"
#include "job/map_words.h"
#include "job/stages.h"
#include "options/option_table.h"
#include "options/parse.h"

namespace kiln {
namespace {

Warning mean_error_warning(const PlannedBake& planned) {
  if (planned.chosen.error.mean_degrees <= planned.wanted) {
    return map_bounds_warning(planned.bounds, planned.chosen.width);
  }
  const std::string wanted_text = formatted(
      "No match is expected to reach a mean error of %.3g degrees with this low poly and the "
      "given ",
      planned.wanted);
  const std::string reached = formatted(
      "; the map that is written reaches %.3g. Use more faces, a larger map, or a larger error "
      "bound.",
      planned.chosen.error.mean_degrees);
  return {"error-not-reached", wanted_text + option("size") + reached, 1};
}

/// The warning about misses of a low poly that Kiln made. Such a low poly has the place and scale of the high poly, so
/// a sample can only miss because the two surfaces lie too far apart.
Message explain_misses_of_made_low(const BakeReport& report, double deviation) {
  const std::string text = formatted(
      "%s of the samples found no point of the high poly within the search distance: the low poly "
      "deviates by up to %.1f%% of the diagonal. Use more faces, or raise ",
      percent(static_cast<double>(report.missed) / static_cast<double>(report.samples), 2).c_str(),
      100 * deviation);
  return text + option("max_distance") + ".";
}

/// Completes the library's warning about misses: the file, the place, and remedies among the job's options.
void complete_miss_warning(const BakeScene& scene, BakeResult& result) {
  const Mesh& low = scene.low.mesh;
  const bool is_made_by_kiln = scene.low.simplified && !result.report.uv && !result.report.views;
  const bool misses_over_half = result.report.missed * 2 > result.report.samples;
  for (Warning& warning : result.report.warnings) {
    if (warning.code != "many-misses") continue;
    const Message description =
        is_made_by_kiln ? explain_misses_of_made_low(result.report, scene.low.simplified->error)
                        : warning.message;
    warning.message =
        "'" + scene.low.path + "': " + description + " " + describe_missed_place(result, low) +
        (is_made_by_kiln ? "" : bounds_mismatch_hint(scene.high.mesh(), low, misses_over_half));
  }
}

/// Rejects a bake that matched no sample, completes warnings about misses, and explains misses if --reasons is given.
void check_baked_layout(const BakeScene& scene, const Source& source, BakedLayout& baked) {
  if (baked.result.cancelled) throw Cancelled{};
  check_result(baked.result.report, scene.high.mesh(), scene.low.mesh);
  complete_miss_warning(scene, baked.result);
  if (scene.run.job.reasons) {
    baked.reasons = explain(*baked.result.match, source, scene.low.mesh, baked.options);
  }
}

/// Calls RunHooks::sample, and removes the maps that its images replace. \param options  of the match
void sample_images(const BakeScene& scene, const Source& source, BakeOptions options,
                   BakedLayout& baked) {
  options.progress = {};  // the bake reports its own progress
  const MatchResult found = match(source, scene.low.mesh, options);
  if (found.cancelled) throw Cancelled{};
  baked.sampled_images = scene.run.hooks.sample(found.match, scene.high.mesh());
  const auto is_replaced = [&](std::string_view name) {
    return baked.sampled_images.contains(std::string(name));
  };
  std::erase_if(baked.options.maps, [&](MapKind map) { return is_replaced(map.name); });
  std::erase_if(baked.options.transfers,
                [&](const auto& transfer) { return is_replaced(transfer.name); });
}

/// True if images of RunHooks::sample replace all maps to bake. If only transfers remain, a bake still needs one map,
/// so the shading map is baked but not written.
bool sampled_images_replace_all_maps(BakedLayout& baked) {
  BakeOptions& options = baked.options;
  if (!options.maps.empty() || !options.own_maps.empty() || !options.variants.empty()) return false;
  if (options.transfers.empty()) return true;
  options.maps = {shading_map()};
  baked.has_only_sampled_images = true;
  return false;
}

void load_saved_match(const BakeScene& scene, BakedLayout& baked) {
  const std::string& path = scene.run.job.load_match;
  if (path.empty()) return;
  baked.saved_match = std::make_shared<const Match>(load_match(match_file(path, scene.names())));
  baked.options.match.saved = baked.saved_match.get();
}

/// Bakes with --match auto, which also chooses the size of the map.
PlannedBake bake_by_best_match(const BakeScene& scene, const Source& source,
                               const BakeOptions& options) {
  const Job& job = scene.run.job;
  PlanOptions plan;
  plan.bake = options;
  plan.bounds = map_bounds(job);
  plan.choose_rays = !job.given.contains("--ao-rays");
  if (const std::string bound = angle_bound(job); !bound.empty()) {
    plan.max_error = parse_degrees(
        job.low.make.max_angle.empty() ? option("max_error") : option("max_angle"), bound);
  }
  PlannedBake planned = bake_planned(source, scene.low.mesh, plan);
  if (planned.result.cancelled) throw Cancelled{};
  if (!planned.reached) scene.run.log.warnings.push_back(mean_error_warning(planned));
  return planned;
}

/// The options with the match and size that a plan chose; the size is unchanged if the plan has no map.
BakeOptions options_of_plan(const BakeOptions& asked, const LowPolyPlan& plan,
                            const BakeReport& report) {
  BakeOptions options = asked;
  const Candidate& chosen = plan.chosen;
  options.match.method = chosen.method;
  if (chosen.size == 0) return options;
  options.width = options.height = chosen.size;
  if (!options.match.max_distance && !options.match.cage) {
    options.match.max_distance = Length::absolute(report.max_distance);
  }
  return options;
}

}  // namespace

BakeResult bake_high(const HighPolyInput& high, const Source& source, const Mesh& low,
                     const BakeOptions& options, const OpenMapRows* open_rows) {
  try {
    return open_rows != nullptr ? bake_rows(source, low, options, *open_rows)
                                : bake(source, low, options);
  } catch (const Error& error) {
    if (!high.heights || !obeys(find_match(options.match.method.name), "match.uv") ||
        error.code() != ErrorCode::input) {
      throw;
    }
    throw OptionError(error.message() + " HIGH is a height field: " + option_of("--height") +
                          " and " + option("extent") +
                          " must have the values with which LOW was made.",
                      ErrorCode::input);
  }
}

BakedLayout bake_layout(const BakeScene& scene, const Source& source, BakeOptions options) {
  BakedLayout baked{.options = std::move(options)};
  load_saved_match(scene, baked);
  if (scene.run.hooks.sample) {
    sample_images(scene, source, baked.options, baked);
    if (sampled_images_replace_all_maps(baked)) return baked;
  }
  if (scene.run.job.match_auto) {
    baked.planned = bake_by_best_match(scene, source, baked.options);
    baked.result = std::move(baked.planned->result);
  } else {
    const OpenMapRows open_rows = [&](const BakedMap& map) -> MapRows& {
      return begin_map_file(scene, map, baked);
    };
    baked.result = bake_high(scene.high.input, source, scene.low.mesh, baked.options,
                             writes_map_rows(scene, baked.options) ? &open_rows : nullptr);
  }
  check_baked_layout(scene, source, baked);
  return baked;
}

BakedLayout bake_planned_low(const BakeScene& scene, const Source& source, BakeOptions options,
                             LowMesh& low, PlannedLow& planned) {
  const Job& job = scene.run.job;
  const RunHooks& hooks = scene.run.hooks;
  RunLog& log = scene.run.log;
  BakedLayout baked{.options = std::move(options)};
  load_saved_match(scene, baked);
  planned = job.low.make.lods > 0 ? make_lods(scene, source, baked.options)
            : job.max_bytes != 0  ? make_byte_plan(scene, source, baked.options)
                                  : make_plan(scene, source, baked.options);
  baked.result = move_plan_result(planned, low);
  if (hooks.needs_uvs && low.mesh.uv_triangles.empty()) {
    const std::uint32_t size = std::min(baked.options.width, baked.options.height);
    low.mesh = unwrap(low.mesh, unwrap_options(job.unwrap_method, size));
    low.mesh.name = low.stem;
  }
  if (hooks.sample) {
    sample_images(scene, source, options_of_plan(baked.options, planned.plan, baked.result.report),
                  baked);
    std::erase_if(baked.result.maps, [&](const BakedMap& map) {
      return baked.sampled_images.contains(std::string(map.kind.name));
    });
  }
  warn_of_heavy_low(low.mesh, scene.high.mesh(), log.warnings);
  if (low.simplified) {
    warn_of_lost_shape(
        *low.simplified,
        "Rendered normals do not show this. Use a smaller angle, or set the number of " +
            option("faces") + ".",
        log.warnings);
  }
  if (planned.plan.chosen.size != 0) check_baked_layout(scene, source, baked);
  return baked;
}

}  // namespace kiln
