// Runs the stages of a job in their order.
#include "job/run.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "base/stopwatch.h"
#include "job/check_result.h"
#include "job/files.h"
#include "job/map_words.h"
#include "job/root_causes.h"
#include "job/stages.h"
#include "job/streaming.h"
#include "kiln/files.h"
#include "mesh/steps.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// Warns if all directions of a list of weights have the same weight.
void warn_about_weights(const Job& job, const VisibilityOptions& visibility,
                        std::vector<Warning>& warnings) {
  const std::vector<VisibilityOptions::Likelihood>& list = visibility.likelihoods;
  if (list.empty() || std::any_of(list.begin(), list.end(), [&](const auto& entry) {
        return entry.weight != list.front().weight;
      })) {
    return;
  }
  warnings.push_back({"equal-view-weights",
                      "'" + job.view_weights + "' gives all views the same weight, as " +
                          option("view_weight", "all") +
                          " does. Each direction uses the weight of the nearest line: add lines "
                          "with smaller weights for directions without viewers.",
                      1});
}

/// Creates output folders, and rejects outputs that would overwrite foreign files, before any work.
void prepare_outputs(const Job& job, const RunHooks& hooks) {
  check_outputs(job, {}, hooks);
  if (job.in_memory) return;
  prepare_output_folder(out_folder(job));
  for (const std::string& file : {job.json, job.save_match, job.save_cage, job.save_source}) {
    prepare_parent(file);
  }
}

/// If Kiln makes the whole asset, it uses the texture sets of HIGH's materials, unless --sets is given.
void adopt_texture_sets_of_high(Job& job, const LoadedHigh& high, RunLog& log) {
  if (job.sets || asset_file(job).empty() || !job.low.given.empty()) return;
  job.sets = SetsBy::material;
  if (!unwraps_sets(job) || choose_texture_sets(high.mesh()) != SetsBy::material) {
    job.sets.reset();
    return;
  }
  log.line("texture sets: one per material, as in HIGH (" + option("sets", "one") +
           " bakes one atlas)");
}

/// The report of the simplified low poly, made by this run or by the caller; null if there is none.
const SimplifyReport* simplify_report_of(const Job& job, const LowMesh& low) {
  if (low.simplified) return &*low.simplified;
  return job.low.given.size() == 1 ? job.low.given.front().simplified.get() : nullptr;
}

/// Sets the search distance to the deviation of the simplified low poly. The distance is stored in the job, too, since
/// the report states it.
void apply_search_distance(Job& job, const LoadedHigh& high, const LowMesh& low,
                           BakeOptions& options) {
  const SimplifyReport* const simplified = simplify_report_of(job, low);
  if (simplified == nullptr || high.is_height_field() || job.cage_auto || has_cage_mesh(job))
    return;
  set_search_distances(*simplified, options.match);
  job.bake.match.near_distance = options.match.near_distance;
}

/// Reads or makes LOW before the bake. A low poly that is planned during the bake gets only its file name here.
LowMesh prepare_low_unless_planned(const Job& job, const LoadedHigh& high, RunLog& log) {
  LowMesh low;
  if (plans_low_poly(job)) {
    low.stem = low_stem(job);
    low.made = true;
  } else {
    low = prepare_low(job, high, log);
  }
  low.path = job.low.given.empty()
                 ? (std::filesystem::path(out_folder(job)) / (low.stem + ".obj")).string()
                 : low_name(job);
  return low;
}

/// Warns if LOW and HIGH do not match in position, size or axes.
void warn_of_mesh_mismatch(const Job& job, const LoadedHigh& high, const LowMesh& low,
                           const MatchOptions& match, RunLog& log) {
  if (job.low.given.empty()) {
    if (plans_low_poly(job) || bakes_onto_plane(job)) return;
    if (high.streamed == nullptr) warn_of_heavy_low(low.mesh, high.mesh(), log.warnings);
    if (!low.simplified) return;
    warn_of_lost_shape(*low.simplified, "Use more " + option("faces") + ".", log.warnings);
  } else if (high.may_face_inwards() && !match.two_sided) {
    const Message inside_out = explain_inside_out(high.mesh(), low.mesh);
    if (!inside_out.empty()) log.warnings.push_back({"high-inside-out", inside_out, 1});
  }
}

/// Seconds spent on planning, without the bake of the result.
double planning_seconds(const BakeReport& report, double all) {
  const double baked = report.seconds_build + report.seconds_texels + report.seconds_match +
                       report.seconds_detail + report.seconds_recall + report.seconds_image +
                       report.seconds_mips + report.seconds_errors;
  return std::max(0.0, all - baked);
}

/// The failure message of a bake that missed more samples than --max-missed allows.
Message too_many_missed(const Job& job, const BakeResult& result, const LowMesh& low,
                        double missed) {
  Message message = "'" + low.path +
                    "': " + formatted("%.4g%% of the samples were missed, but ", missed) +
                    option("max_missed") + formatted(" is %.4g. ", job.max_missed_percent);
  if (!result.maps.empty()) message += describe_missed_place(result, low.mesh);
  if (!job.load_match.empty()) {
    return message + " Save the match again with a longer " + option("max_distance") + ".";
  }
  const MatchMethod nearest_match = distance_match();
  const Message fallback = "add " + option("fallback", nearest_match.name) + ".";
  const bool uses_distance = job.match_auto || any_match_uses_option(job, "match.max_distance");
  if (!uses_distance) return message + " To find them, " + fallback;
  return message + " Raise " + option("max_distance") +
         (requests_match(job, nearest_match) ? "." : ", or " + fallback);
}

/// The failure message if the result exceeds a limit of the job; empty if it does not.
Message explain_exceeded_limit(const Job& job, const RunOutcome& outcome) {
  const BakeReport& report = outcome.baked.result.report;
  const LowMesh& low = outcome.scene.low;
  const double missed_percent = 100.0 * static_cast<double>(report.missed) /
                                static_cast<double>(std::max<std::uint64_t>(1, report.samples));
  if (missed_percent > job.max_missed_percent) {
    return too_many_missed(job, outcome.baked.result, low, missed_percent);
  }
  if (low.simplified && misses_faces(*low.simplified, job.low.make.faces)) {
    return too_many_faces(*low.simplified, job.low.make.faces);
  }
  const auto misses_angle_bound = [&](const std::optional<PlannedBake>& plan) {
    return plan && !plan->reached && !angle_bound(job).empty();
  };
  const PlannedLow* const planned = outcome.planned;
  const bool reached = planned == nullptr ? true
                       : planned->lods    ? planned->lods->reached
                                          : planned->plan.reached;
  if (!reached || misses_angle_bound(outcome.baked.planned) ||
      std::any_of(outcome.scene.sets.begin(), outcome.scene.sets.end(),
                  [&](const BakedSet& set) { return misses_angle_bound(set.planned); })) {
    return "the requested error was not reached.";
  }
  return {};
}

/// Collects the warnings of the library's reports in the log.
void collect_warnings(const RunOutcome& outcome, const Source& source, RunLog& log) {
  const LowMesh& low = outcome.scene.low;
  if (low.simplified) log.warn(low.simplified->warnings);
  if (low.unwrapped) log.warn(low.unwrapped->warnings);
  if (outcome.planned != nullptr && outcome.planned->lods)
    log.warn(outcome.planned->lods->warnings);
  if (outcome.scene.high.prepared == nullptr) log.warn(source.warnings());
  log.warn(outcome.baked.result.report.warnings);
}

JobResult run_stages(const std::function<Device()>& open_device, const Job& given,
                     const RunHooks& hooks, RunLog& log) {
  Stopwatch stopwatch;
  StageSeconds seconds;
  Job job = resolve_job(given);
  const RunContext run{job, hooks, log};
  BakeOptions options = options_of(job);
  prepare_outputs(job, hooks);
  if (hooks.on_start) hooks.on_start();
  const Device device = open_device();

  // Stage: the high poly
  std::unique_ptr<AtomicFile> saved_source;
  LoadedHigh high;
  high.prepared = hooks.high;
  high.streamed = open_streamed_high(job, options, hooks, log);
  if (high.streamed != nullptr) {
    high.input.mesh = sample_of(*high.streamed, kSampledTriangles);
    high.input.shading = shading_of(*high.streamed);
    if (choose_streamed_asset_maps(job, *high.streamed)) options = options_of(job);
    if (job.low.given.empty()) high.chunks = sort_into_chunks(high, 0, log);
  } else if (high.prepared == nullptr) {
    high = read_high(job, log);
    if (!job.save_source.empty()) saved_source = begin_saved_source(job, high, log);
    if (add_material_maps(job, high, log)) options = options_of(job);
    repair_high(job, high, log);
    options.match.uv = uv_options(high.input, options.match.uv);
  } else if (high.prepared->height_field) {
    if (!job.given.contains("--match")) {
      job.bake.match.method = options.match.method = first_match("match.uv");
    }
    options.match.uv = height_field_uv_options(high.mesh(), options.match.uv);
  }
  if (high.streamed == nullptr) read_textures(job, high, options, log);
  const std::size_t warnings_of_high = log.warnings.size();
  seconds.load = stopwatch.lap();
  warn_about_weights(job, options.match.visibility, log.warnings);

  // Stage: the low poly, and the inputs of the match
  if (!plans_low_poly(job)) adopt_texture_sets_of_high(job, high, log);
  LowMesh low = prepare_low_unless_planned(job, high, log);
  if (!plans_low_poly(job)) apply_search_distance(job, high, low, options);
  warn_of_mesh_mismatch(job, high, low, options.match, log);
  (job.low.given.empty() ? seconds.low : seconds.load) += stopwatch.lap();
  MatchInputs match_inputs;
  match_inputs.read(job, high.mesh(), low.mesh, log.warnings);
  if (options.match.cage_mesh != nullptr) {
    check_cage_directions(job, low.mesh, *options.match.cage_mesh);
  }
  match_inputs.apply(options);
  seconds.load += stopwatch.lap();

  std::optional<Source> built_source;
  if (high.prepared == nullptr) {
    log.progress(kProgressAtSource, "preparing the high poly");
    if (high.streamed != nullptr) {
      built_source = make_streamed_source(device, job, high, log);
    } else if (hooks.make_source) {
      built_source = hooks.make_source(device, high.input.mesh, job.traversal);
    } else {
      built_source.emplace(device, high.input.mesh, job.traversal);
    }
  }
  const Source& source = high.prepared != nullptr ? high.prepared->source : *built_source;
  if (high.prepared == nullptr) attach_saved_tree(job, source);
  seconds.build = stopwatch.lap();

  FoundSets found = find_sets({run, high, low}, source, options);
  job.sets = found.by;
  const BakeScene scene{run, high, low, found.sets};
  choose_seam_normals(scene, source, options, low);
  seconds.low += stopwatch.lap();
  if (job.cage_auto) {
    match_inputs.find_cage(source, low.mesh, options, log.warnings);
    match_inputs.apply_cage(options);
    seconds.cage = stopwatch.lap();
  }
  options.report.keep_match = options.report.keep_match || needs_asset_match(scene);

  // Stage: the maps. If LOW has several texture sets, this stage writes them as well, one after the other.
  const bool planned = plans_low_poly(job);
  PlannedLow plan;
  AssetParts asset;
  Json set_reports = Json::array();
  JobOutputs outputs;
  BakedLayout baked;
  if (!found.sets.empty()) {
    baked = bake_sets(run, high, low, found.sets, source, options, asset, set_reports, outputs);
  } else {
    options.progress = bake_progress(log);
    baked = planned ? bake_planned_low(scene, source, options, low, plan)
                    : bake_layout(scene, source, options);
  }
  const PlannedLow* const low_plan = planned ? &plan : nullptr;
  if (planned && !job.given.contains("--format")) {
    job.image.format = plan.plan.chosen.bits == 8 ? ImageFormat::png8 : ImageFormat::png16;
  }
  const double bake_seconds = stopwatch.lap();
  if (planned || job.match_auto) seconds.plan = planning_seconds(baked.result.report, bake_seconds);

  // Stage: the files
  if (hooks.on_baked) {
    BakedJob result{baked.result, baked.planned, planned ? &plan.plan : nullptr,
                    low.simplified ? &*low.simplified : nullptr};
    hooks.on_baked(result);
  }
  drop_unwritten_maps(hooks, baked);
  if (!found.sets.empty()) {
    write_asset_of_sets(scene, baked, set_reports, asset, outputs);
    save_found_cage(scene, match_inputs, outputs);
  } else if (hooks.writes) {
    if (plan.lods) {
      save_lods(scene, source, plan, baked, asset, outputs);
    } else {
      save_low_and_maps(scene, source, asset_file(job), low_plan, baked, asset, outputs);
      save_beside_maps(scene, baked, outputs);
      save_found_cage(scene, match_inputs, outputs);
    }
  }
  if (planned && !plan.byte_plan_result && hooks.draw_plan &&
      !hooks.draw_plan(plan.plan, out_folder(job), low.stem, outputs.files, log.warnings)) {
    throw Cancelled{};
  }
  if (saved_source != nullptr) save_source(run, source, *saved_source, outputs);
  seconds.save = stopwatch.lap();

  const RunOutcome outcome{scene,       match_inputs, baked,   low_plan,         asset,
                           set_reports, outputs,      seconds, stopwatch.total()};
  collect_warnings(outcome, source, log);
  JobResult result;
  result.report = to_text(report_json(outcome, device, source));
  add_summary(outcome, source.stats());
  if (!job.json.empty() && job.json != "-") save_text(job.json, result.report);
  log.report_progress(1, "done");
  result.causes = root_causes(log.warnings, warnings_of_high);
  result.failure = explain_exceeded_limit(job, outcome);
  result.files = std::move(outputs.files);
  result.glb = std::move(outputs.glb);
  result.maps = std::move(outputs.maps);
  result.low = std::move(low.mesh);
  result.summary = std::move(log.lines);
  result.warnings = std::move(log.warnings);
  return result;
}

}  // namespace

JobResult run_job(const std::function<Device()>& device, const Job& job, const Progress& progress,
                  const RunHooks& hooks) {
  RunLog log(progress, hooks.line);
  try {
    return run_stages(device, job, hooks, log);
  } catch (const Cancelled&) {
    JobResult result;
    result.cancelled = true;
    return result;
  }
}

JobResult run(const Device& device, const Job& job, const Progress& progress) {
  return run_job([&] { return device; }, job, progress, {});
}

}  // namespace kiln
