#include "job/run.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

#include "base/percent.h"
#include "job/check_result.h"
#include "job/files.h"
#include "job/job_options.h"
#include "job/map_words.h"
#include "job/match_inputs.h"
#include "job/root_causes.h"
#include "job/transfers.h"
#include "kiln/files.h"
#include "kiln/measure.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "options/option_table.h"
#include "options/parse.h"

namespace kiln {
namespace {

Warning not_reached(const PlannedBake& planned) {
  if (planned.chosen.error.mean_degrees <= planned.wanted) {
    return bounds_not_reached(planned.bounds, planned.chosen.width);
  }
  const std::string wanted = formatted(
      "No match is expected to reach a mean error of %.3g degrees with this low poly and ",
      planned.wanted);
  const std::string reached = formatted(
      "; the map written reaches %.3g. Give the low poly more faces, allow a larger map, or accept "
      "more.",
      planned.chosen.error.mean_degrees);
  return {"error-not-reached", wanted + option("size") + reached, 1};
}

/// bake(); of layouts that disagree over a height field, it also says what is the likely reason.
BakeResult bake_from(const HighPolyInput& dense, const Source& source, const Mesh& low,
                     const BakeOptions& options) {
  try {
    return bake(source, low, options);
  } catch (const Error& error) {
    if (!dense.heights || !obeys(find_match(options.match.method.name), "match.uv") ||
        error.code() != ErrorCode::input) {
      throw;
    }
    throw OptionError(error.message() + " HIGH is a height field: " + option_of("--height") +
                          " and " + option("extent") +
                          " must be "
                          "the values that LOW was made with.",
                      ErrorCode::input);
  }
}

/// A list of likely views that says nothing.
void warn_about_weights(const Job& arguments, const VisibilityOptions& visibility,
                        std::vector<Warning>& warnings) {
  const std::vector<VisibilityOptions::Likelihood>& list = visibility.likelihoods;
  if (list.empty() || std::any_of(list.begin(), list.end(), [&](const auto& entry) {
        return entry.weight != list.front().weight;
      })) {
    return;
  }
  warnings.push_back({"equal-view-weights",
                      "'" + arguments.view_weights + "' gives all views the same weight, as " +
                          option("view_weight", "all") +
                          " does. Each "
                          "direction takes the weight of the nearest line: add lines with less "
                          "weight for sides that nobody looks from.",
                      1});
}

/// Place where most is missed.
std::string missed_place(const BakeResult& result, const Mesh& low) {
  const Image& map = result.maps.front().image;
  return describe(largest_missed_patch(result.coverage, map.width, map.height, low));
}

/// Check of a low poly that was made here: both meshes lie in one place.
Message misses_of_made(const BakeReport& report, double strays) {
  const std::string text = formatted(
      "%s of the samples found no point of the high poly within the distance: the "
      "low poly strays up to %.1f%% of the diagonal. Ask for more faces, or raise ",
      percent(static_cast<double>(report.missed) / static_cast<double>(report.samples), 2).c_str(),
      100 * strays);
  return text + option("max_distance") + ".";
}

/// The library knows neither the file nor what is asked for beside it.
void name_place_of_misses(BakeRun& run) {
  BakeResult& result = run.result;
  const Mesh& low = run.low.mesh;
  const bool made = run.low.simplified && !result.report.uv && !result.report.views;
  const bool most = result.report.missed * 2 > result.report.samples;
  for (Warning& warning : result.report.warnings) {
    if (warning.code != "many-misses") continue;
    const Message what =
        made ? misses_of_made(result.report, run.low.simplified->error) : warning.message;
    warning.message = "'" + run.low_path + "': " + what + " " + missed_place(result, low) +
                      (made ? "" : hint_of_boxes(run.high_mesh(), low, most));
  }
}

/// A map with nothing in it is no success; where much is missed is told.
void judge_result(BakeRun& run) {
  check_result(run.result.report, run.high_mesh(), run.low.mesh);
  name_place_of_misses(run);
}

/// A low poly that was made here tells how far it strays.
void widen_search(BakeRun& run) {
  const std::vector<JobInput>& given = run.arguments.low.given;
  const SimplifyReport* const made = run.low.simplified  ? &*run.low.simplified
                                     : given.size() == 1 ? given.front().simplified.get()
                                                         : nullptr;
  const bool is_field =
      run.high.heights || (run.hooks.high != nullptr && run.hooks.high->height_field);
  if (made == nullptr || is_field || run.arguments.cage_auto || has_cage_mesh(run.arguments)) {
    return;
  }
  look_as_far(*made, run.options.match);
  run.arguments.bake.match.near_distance = run.options.match.near_distance;  // reports say it
}

/// Time of planning, without the bake of the result.
double planning(const BakeReport& report, double all) {
  const double baked = report.seconds_build + report.seconds_texels + report.seconds_match +
                       report.seconds_detail + report.seconds_recall + report.seconds_image +
                       report.seconds_mips + report.seconds_errors;
  return std::max(0.0, all - baked);
}

/// More was missed than --max-missed allows.
Message too_many_missed(const Job& arguments, const BakeResult& result, const Mesh& low,
                        const std::string& path, double missed) {
  const Message text = formatted("%.4g%% of the samples were missed, but ", missed) +
                       option("max_missed") + formatted(" is %.4g. ", arguments.max_missed_percent);
  const Message message =
      "'" + path + "': " + text + (result.maps.empty() ? "" : missed_place(result, low));
  if (!arguments.load_match.empty()) {
    return message + " Save the match again with a longer " + option("max_distance") + ".";
  }
  const MatchMethod around = nearest_match();
  const Message fallback = "add " + option("fallback", around.name) + ".";
  const bool far = arguments.match_auto || chain_obeys(arguments, "match.max_distance");
  if (!far) return message + " To find them, " + fallback;
  return message + " Raise " + option("max_distance") +
         (matches_by(arguments, around) ? "." : ", or " + fallback);
}

/// HIGH's materials, where its file has them itself, and they were read with it. MTL files tell more when asked anew:
/// what they lack.
std::span<const Material> known_materials(const BakeRun& run) {
  const JobInput& first = run.arguments.high.front();
  if (run.hooks.high != nullptr) return run.hooks.high->materials;
  const bool apart = !first.asset && lower_extension(first.name) == ".obj";
  if (apart || run.arguments.high.size() > 1) return {};
  return run.high.beside.materials;
}

/// An asset that Kiln makes whole has the texture sets of its source.
void take_sets_of_high(BakeRun& run) {
  Job& arguments = run.arguments;
  if (arguments.sets || asset_file(arguments).empty() || !arguments.low.given.empty()) return;
  arguments.sets = SetsBy::material;
  if (!lays_out_sets(arguments) || choose_texture_sets(run.high_mesh()) != SetsBy::material) {
    arguments.sets.reset();
    return;
  }
  run.console.line("texture sets: a material each, as HIGH has them (" + option("sets", "one") +
                   " bakes an atlas of all)");
}

/// Reads, repairs and shades HIGH. \returns false where it was cancelled
bool load_high_poly(BakeRun& run) {
  const Job& arguments = run.arguments;
  const bool made = arguments.low.given.empty();
  for (const std::string& file : high_files(arguments)) {
    if (!run.console.progress(0, "reading " + file)) return false;
  }
  run.high = load_high(arguments.high, arguments.heights, load_options(arguments, MeshSide::high),
                       has_more_files(arguments) && !made, run.warnings,
                       !asset_file(arguments).empty(), arguments.keep_hulls);
  if (run.high.heights) run.arguments.heights = run.high.field;
  choose_asset_maps(run);
  run.cleaned = clean_high(run.high.mesh, clean_options(arguments), run.warnings);
  shade(arguments.frame.shading, run.high, run.warnings);
  if (!arguments.load_match.empty() &&
      (!run.cleaned.warnings.empty() || arguments.given.contains("--clean"))) {
    run.warnings.push_back({"match-of-clean",
                            option("load_match") + " '" + arguments.load_match +
                                "' is right only if it was saved with the same " + option("clean") +
                                ", since turned faces count their corners otherwise.",
                            1});
  }
  run.options.match.uv = uv_options(run.high, run.options.match.uv);
  return true;
}

/// Options that follow from a HIGH that was prepared before.
void apply_prepared_high(BakeRun& run) {
  if (!run.hooks.high->height_field) return;
  if (!run.arguments.given.contains("--match")) {
    run.arguments.bake.match.method = run.options.match.method = first_match("match.uv");
  }
  run.options.match.uv = uv_options_over(run.high_mesh(), run.options.match.uv);
}

/// Reads all files but LOW's, and makes or reads LOW. \returns false where it was cancelled
bool read_inputs(BakeRun& run) {
  const Job& arguments = run.arguments;
  const bool made = arguments.low.given.empty();
  const bool prepared = run.hooks.high != nullptr;
  if (prepared) {
    apply_prepared_high(run);
  } else if (!load_high_poly(run)) {
    return false;
  }
  const Mesh& high = run.high_mesh();
  load_textures(arguments, high, run.options, run.warnings, known_materials(run));
  if (!asset_file(arguments).empty() && !arguments.given.contains("--maps")) {
    // The maps are those that some material has: in others the default is meant.
    std::erase_if(run.warnings, [](const Warning& w) { return w.code == "material-value"; });
  }
  if (!prepared) {
    const std::size_t cleaned = high.triangles.size();
    apply_alpha_test(arguments, run.options, run.high.mesh, run.warnings);
    run.cleaned.faces_outwards = run.cleaned.faces_outwards && high.triangles.size() == cleaned;
  }
  run.warnings_of_high = run.warnings.size();
  run.stages.load = run.watch.lap();
  warn_about_weights(arguments, run.options.match.visibility, run.warnings);
  if (plans_low_poly(arguments)) {
    run.low.stem = low_stem(arguments);
    run.low.made = true;
  } else {
    take_sets_of_high(run);
    run.low = prepare_low(arguments, high, run.high, run.console, run.warnings);
    widen_search(run);
    if (made && !onto_plane(arguments)) {
      warn_of_heavy_low(run.low.mesh, high, run.warnings);
      if (run.low.simplified) {
        warn_of_lost_shape(*run.low.simplified, "Ask for more " + option("faces") + ".",
                           run.warnings);
      }
    }
  }
  const bool may_face_inwards =
      prepared ? run.hooks.high->faces_inwards : !run.cleaned.faces_outwards;
  if (!made && may_face_inwards && !run.options.match.two_sided) {
    const Message inside_out = why_inside_out(high, run.low.mesh);
    if (!inside_out.empty()) run.warnings.push_back({"high-inside-out", inside_out, 1});
  }
  run.low_path =
      made ? (std::filesystem::path(out_folder(arguments)) / (run.low.stem + ".obj")).string()
           : low_name(arguments);
  (made ? run.stages.low : run.stages.load) += run.watch.lap();
  if (!arguments.cage_mesh.empty()) {
    run.cage_mesh = load_cage(arguments.cage_mesh, run.low.mesh,
                              load_options(arguments, MeshSide::low), &run.warnings);
    check_cage_directions(arguments, run.low.mesh, *run.cage_mesh);
    run.options.match.cage_mesh = &*run.cage_mesh;
  } else if (run.options.match.cage_mesh != nullptr) {
    check_cage_directions(arguments, run.low.mesh, *run.options.match.cage_mesh);
  }
  for (const std::string& file : arguments.occluders) {
    run.options.occlusion.by_others.push_back(&run.occluders.emplace_back(
        load_mesh(file, load_options(arguments, MeshSide::other), &run.warnings)));
  }
  share_occluders(run.options);
  if (arguments.parts_by) {
    run.parts = pair_parts(high, run.low.mesh, part_names(arguments));
    run.options.match.parts = &*run.parts;
    run.warnings.insert(run.warnings.end(), run.parts->warnings.begin(), run.parts->warnings.end());
  }
  run.stages.load += run.watch.lap();
  return true;
}

/// The cage of --cage auto, for what follows as one that was given.
void make_cage(BakeRun& run, const Source& source) {
  if (!run.arguments.cage_auto) return;
  run.cage = find_cage(source, run.low.mesh, run.options);
  run.options.match.cage_mesh = &run.cage->mesh;
  run.options.match.max_distance.reset();  // that was for finding it
  run.warnings.insert(run.warnings.end(), run.cage->warnings.begin(), run.cage->warnings.end());
  run.stages.cage = run.watch.lap();
}

/// Error of rendered normals of LOW with a small map of its own, mean degrees; with nothing found, none.
std::optional<double> normals_off(const BakeRun& run, const Source& source, const Mesh& low,
                                  const ScreenPictures& pictures) {
  constexpr std::uint32_t kMostTexels = 256;
  const BakeOptions plain;
  BakeOptions options = run.options;
  options.width = std::min(options.width, kMostTexels);
  options.height = std::min(options.height, kMostTexels);
  options.maps = plain.maps;
  options.encoding.space = plain.encoding.space;
  options.encoding.bitangent = plain.encoding.bitangent;
  options.encoding.flip_y = options.encoding.two_component = options.encoding.raw =
      options.encoding.mips = false;
  options.report = {.recall = 0};
  options.encoding.ranges = {};
  options.transfers = {};
  options.own_maps = {};
  options.variants = {};
  options.progress = {};
  const BakeResult result = bake_from(run.high, source, low, options);
  if (result.cancelled || result.report.missed == result.report.samples) return std::nullopt;
  return pictures.degrees(low, result.maps[0].image, options);
}

/// Splitting seams gives corners other normals. What they were may suit better, as weighted normals of bevels do:
/// the normals that a picture shows decide.
void judge_seams(BakeRun& run, const Source& source) {
  constexpr double kClearly = 0.98;
  LowMesh& low = run.low;
  if (!low.whole && !low.seam_warning) return;
  // A match is of one size, and of LOW as it is; one map of several sets shows nothing.
  if (has_saved_match(run.arguments) || !run.sets.empty()) {
    if (low.seam_warning) run.warnings.push_back(*low.seam_warning);
    return;
  }
  constexpr std::uint32_t kPixelsOfHigh = 64;
  const ScreenPictures pictures(source, kPixelsOfHigh);
  const Mesh other = low.whole ? std::move(*low.whole) : split_at_seams(low.mesh);
  const Mesh &whole = low.whole ? other : low.mesh, &split = low.whole ? low.mesh : other;
  const std::optional<double> as_is = normals_off(run, source, whole, pictures);
  const std::optional<double> off = normals_off(run, source, split, pictures);
  if (low.seam_warning) {
    if (as_is && off && *off < kClearly * *as_is) run.warnings.push_back(*low.seam_warning);
    return;
  }
  if (!as_is || !off || *off <= *as_is) return;
  const std::string text = formatted(
      ": with hard edges at its seams, LOW and its map are %.3g degrees "
      "off HIGH's normals; as they are, %.3g. Its normals were left as they are.",
      *off, *as_is);
  run.warnings.push_back({"seams-kept", option("split_at_seams") + text, low.soft_seams});
  low.mesh = other;
}

}  // namespace

namespace {

/// Samples the caller's function, whose images replace the maps of their names. \returns false where it was cancelled
bool sample_images(BakeRun& run, const Source& source, BakeOptions by) {
  by.progress = {};  // the bake tells it
  MatchResult found = match(source, run.low.mesh, by);
  if (found.cancelled) return false;
  run.own_images = run.hooks.sample(found.match, run.high_mesh());
  const auto is_own = [&](std::string_view name) {
    return run.own_images.contains(std::string(name));
  };
  std::vector<MapKind>& maps = run.options.maps;
  std::erase_if(maps, [&](MapKind map) { return is_own(map.name); });
  std::erase_if(run.options.transfers, [&](const auto& transfer) { return is_own(transfer.name); });
  return true;
}

/// The options by which a plan's maps were baked; without a map, those of the largest.
BakeOptions planned_options(const BakeRun& run) {
  BakeOptions options = run.options;
  const Candidate& chosen = run.plan->chosen;
  options.match.method = chosen.method;
  if (chosen.size == 0) return options;
  options.width = options.height = chosen.size;
  if (!options.match.max_distance && !options.match.cage) {
    options.match.max_distance = Length::absolute(run.result.report.max_distance);
  }
  return options;
}

/// After a plan: UVs that are asked for though it needs no map, and images of the caller's own.
bool finish_plan(BakeRun& run, const Source& source) {
  Mesh& low = run.low.mesh;
  if (run.hooks.needs_uvs && low.uv_triangles.empty()) {
    const std::uint32_t size = std::min(run.options.width, run.options.height);
    low = unwrap(low, unwrap_options(run.arguments.unwrap_method, size));
    low.name = run.low.stem;
  }
  if (!run.hooks.sample) return true;
  if (!sample_images(run, source, planned_options(run))) return false;
  std::erase_if(run.result.maps, [&](const BakedMap& map) {
    return run.own_images.contains(std::string(map.kind.name));
  });
  return true;
}

/// True if the caller's own images leave nothing to bake. Transfers are baked beside a map of the shape, which then is
/// not written.
bool has_own_images_alone(BakeRun& run) {
  BakeOptions& options = run.options;
  if (!options.maps.empty() || !options.own_maps.empty() || !options.variants.empty()) return false;
  if (options.transfers.empty()) return true;
  options.maps = {shading_map()};
  run.not_written.insert(std::string(shading_map().name));
  return false;
}

}  // namespace

bool make_maps(BakeRun& run, const Source& source, double done, double share) {
  run.options.progress = [&run, done, share](double part, std::string_view stage) {
    return run.console.progress(kAtBake + (kAtSave - kAtBake) * (done + share * part), stage);
  };
  if (!run.arguments.load_match.empty()) {
    run.match = load_match(match_file(run.arguments.load_match, names_of(run)));
    run.options.match.saved = &*run.match;
  }
  if (plans_low_poly(run.arguments)) {
    const bool made = run.arguments.low.make.lods > 0 ? make_lods(run, source)
                      : run.arguments.max_bytes != 0  ? make_byte_plan(run, source)
                                                      : make_plan(run, source);
    if (!made || !finish_plan(run, source)) return false;
    warn_of_heavy_low(run.low.mesh, run.high_mesh(), run.warnings);
    if (run.low.simplified) {
      warn_of_lost_shape(
          *run.low.simplified,
          "Rendered normals do not tell. Ask for a smaller angle, or for " + option("faces") + ".",
          run.warnings);
    }
    if (run.plan->chosen.size == 0) return true;
  } else if (run.hooks.sample &&
             (!sample_images(run, source, run.options) || has_own_images_alone(run))) {
    return !run.own_images.empty();
  } else if (run.arguments.match_auto) {
    PlanOptions plan_options;
    plan_options.bake = run.options;
    plan_options.bounds = map_bounds(run.arguments);
    plan_options.choose_rays = !run.arguments.given.contains("--ao-rays");
    if (const std::string bound = angle_bound(run.arguments); !bound.empty()) {
      plan_options.max_error = parse_degrees(
          run.arguments.low.make.max_angle.empty() ? option("max_error") : option("max_angle"),
          bound);
    }
    run.planned = bake_planned(source, run.low.mesh, plan_options);
    if (run.planned->result.cancelled) return false;
    if (!run.planned->reached) run.warnings.push_back(not_reached(*run.planned));
    run.result = std::move(run.planned->result);
  } else {
    run.result = bake_from(run.high, source, run.low.mesh, run.options);
  }
  if (run.result.cancelled) return false;
  judge_result(run);
  if (run.arguments.reasons) {
    run.reasons = explain(*run.result.match, source, run.low.mesh, run.options);
  }
  return true;
}

namespace {

void collect_warnings(BakeRun& run, const Source& source) {
  const auto append = [&](std::span<const Warning> list) {
    run.warnings.insert(run.warnings.end(), list.begin(), list.end());
  };
  if (run.low.simplified) append(run.low.simplified->warnings);
  if (run.low.unwrapped) append(run.low.unwrapped->warnings);
  if (run.lods) append(run.lods->warnings);
  if (run.hooks.high == nullptr) append(source.warnings());
  append(run.result.report.warnings);
}

/// Which limit was missed; empty: none.
Message failure_of(const BakeRun& run) {
  const BakeReport& report = run.result.report;
  const double missed = 100.0 * static_cast<double>(report.missed) /
                        static_cast<double>(std::max<std::uint64_t>(1, report.samples));
  if (missed > run.arguments.max_missed_percent) {
    return too_many_missed(run.arguments, run.result, run.low.mesh, run.low_path, missed);
  }
  if (run.low.simplified && misses_faces(*run.low.simplified, run.arguments.low.make.faces)) {
    return too_many_faces(*run.low.simplified, run.arguments.low.make.faces);
  }
  const bool planned = run.lods ? run.lods->reached : !run.plan || run.plan->reached;
  const auto missed_angle = [&](const std::optional<PlannedBake>& plan) {
    return plan && !plan->reached && !angle_bound(run.arguments).empty();
  };
  if (!planned || missed_angle(run.planned) ||
      std::any_of(run.sets.begin(), run.sets.end(),
                  [&](const BakedSet& set) { return missed_angle(set.planned); })) {
    return "the error asked for was not reached.";
  }
  return {};
}

/// Folders are made, and files that must not be written over are looked for, before any work.
void prepare_outputs(const BakeRun& run) {
  const Job& job = run.arguments;
  check_outputs(job, run.save_options, {}, run.hooks);
  if (job.in_memory) return;
  prepare_output_folder(out_folder(job));
  for (const std::string& file : {job.json, job.save_match, job.save_cage}) prepare_parent(file);
}

/// From files to files. \returns false where it was cancelled
bool run_stages(BakeRun& run, const std::function<Device()>& open, JobResult& result) {
  const Device device = open();
  if (!read_inputs(run)) return false;
  std::optional<Source> built;
  if (run.hooks.high == nullptr) {
    if (!run.console.progress(kAtSource, "preparing the high poly")) return false;
    const RayTraversal traversal = run.arguments.traversal;
    if (run.hooks.make_source) {
      built = run.hooks.make_source(device, run.high.mesh, traversal);
    } else {
      built.emplace(device, run.high.mesh, traversal);
    }
  }
  const Source& source = run.hooks.high != nullptr ? run.hooks.high->source : *built;
  run.source = &source;
  run.stages.build = run.watch.lap();
  find_sets(run, source);
  judge_seams(run, source);
  run.stages.low += run.watch.lap();
  make_cage(run, source);
  keep_asset_match(run);
  if (!(run.sets.empty() ? make_maps(run, source) : bake_sets(run, source))) return false;
  const double making = run.watch.lap();
  if (run.plan || run.arguments.match_auto) run.stages.plan = planning(run.result.report, making);
  if (run.hooks.on_baked) run.hooks.on_baked(run);
  std::erase_if(run.result.maps, [&](const BakedMap& map) {
    return run.not_written.contains(std::string(map.kind.name));
  });
  if (run.hooks.writes && run.sets.empty() && !(run.lods ? save_lods(run) : save_outputs(run)))
    return false;
  if (!run.sets.empty() && !save_found_cage(run)) return false;
  if (run.plan && !run.byte_plan && run.hooks.draw_plan &&
      !run.hooks.draw_plan(*run.plan, out_folder(run.arguments), run.low.stem, run.outputs,
                           run.warnings)) {
    return false;
  }
  run.stages.save = run.watch.lap();
  collect_warnings(run, source);
  const double total = run.watch.total();
  result.report = to_text(report_json(run, device, source, total));
  add_summary(run, source.stats(), total);
  return true;
}

}  // namespace

JobResult run_job(const std::function<Device()>& device, const Job& job, const Progress& progress,
                  const RunHooks& hooks) {
  BakeRun run(settled(job), progress, hooks);
  run.options = options_of(run.arguments);
  run.save_options = run.arguments.image;
  run.not_written = hooks.not_written;
  prepare_outputs(run);
  if (hooks.on_start) hooks.on_start();
  JobResult result;
  result.cancelled = !run_stages(run, device, result);
  if (result.cancelled) return result;
  if (!job.json.empty() && job.json != "-") save_text(job.json, result.report);
  run.console.progress(1, "done");
  result.files = std::move(run.outputs);
  result.glb = std::move(run.glb);
  result.maps = std::move(run.stored_maps);
  result.summary = std::move(run.console.lines);
  result.causes = root_causes(run.warnings, run.warnings_of_high);
  result.failure = failure_of(run);
  result.low = std::move(run.low.mesh);
  result.warnings = std::move(run.warnings);
  return result;
}

JobResult run(const Device& device, const Job& job, const Progress& progress) {
  return run_job([&] { return device; }, job, progress, {});
}

}  // namespace kiln
