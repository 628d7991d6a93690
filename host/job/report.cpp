// Builds the report of a bake as JSON.
#include "job/map_words.h"
#include "job/stages.h"
#include "kiln/plan.h"
#include "kiln/version.h"
#include "options/parse.h"

namespace kiln {
namespace {

Json match_trial_json(const PlanTrial& trial) {
  return {{"match", trial.method.name},
          {"width", trial.width},
          {"height", trial.height},
          {"mean_angle_degrees", trial.error.mean_degrees},
          {"p95_angle_degrees", trial.error.p95_degrees},
          {"missed_share", trial.missed},
          {"lost_share", trial.lost},
          {"seconds", trial.seconds}};
}

}  // namespace

Json plan_json(const PlannedBake& planned) {
  Json trials = Json::array();
  for (const PlanTrial& trial : planned.trials) trials.push_back(match_trial_json(trial));
  Json limits = Json::array();
  for (const PlanLimit& limit : planned.limits) {
    limits.push_back({{"match", limit.method.name},
                      {"mean_angle_degrees", limit.error.mean_degrees},
                      {"p95_angle_degrees", limit.error.p95_degrees},
                      {"missed_share", limit.missed},
                      {"seconds", limit.seconds}});
  }
  return {{"chosen", match_trial_json(planned.chosen)},
          {"wanted_degrees", planned.wanted},
          {"reached", planned.reached},
          {"views", kPlanViews},
          {"view_pixels", kPlanPixels},
          {"without_map", describe(planned.without_map)},
          {"seconds_measure", planned.seconds_measure},
          {"least_degrees", planned.least},
          {"limits", limits},
          {"bounds", bounds_json(planned.bounds)},
          {"trials", trials}};
}

namespace {

Json seconds(const StageSeconds& stages, const BakeReport& report, double total) {
  return {{"load", stages.load},
          {"low", stages.low},
          {"build", stages.build + report.seconds_build},
          {"cage", stages.cage},
          {"plan", stages.plan},
          {"texels", report.seconds_texels},
          {"match", report.seconds_match},
          {"detail", report.seconds_detail},
          {"recall", report.seconds_recall},
          {"image", report.seconds_image},
          {"mips", report.seconds_mips},
          {"save", stages.save},
          {"total", total}};
}

}  // namespace

/// Lists the number of samples for each reason, with an example each. The colour is that of NAME_reasons.png.
Json reasons_json(const Reasons& reasons) {
  const auto infos = reason_infos();
  Json list = Json::array();
  for (const ReasonCount& count : reasons.counts) {
    const ReasonInfo& info = infos[static_cast<std::size_t>(count.reason)];
    Json entry = {{"reason", info.name},
                  {"words", info.words.text(option_as_flag)},
                  {"color", info.color},
                  {"samples", count.samples},
                  {"texel", {count.column, count.row}},
                  {"position", count.position}};
    if (count.reason == Reason::far) entry["distance"] = count.distance;
    list.push_back(std::move(entry));
  }
  return list;
}

namespace {

/// Adds the keys that only some bakes have.
void add_optional_keys(const RunOutcome& outcome, Json& json) {
  const BakeScene& scene = outcome.scene;
  const BakedLayout& baked = outcome.baked;
  const StoredMaps& stored = baked.stored;
  const BakeReport& report = baked.result.report;
  const Job& job = scene.run.job;
  const LowMesh& low = scene.low;
  const bool has_single_layout = scene.sets.empty();
  // the values that integer formats store as 0 and 1, per channel
  if (has_single_layout && !stored.ranges.empty()) json["ranges"] = stored.ranges;
  if (has_single_layout && !stored.errors.empty()) json["stored_errors"] = stored.errors;
  if (stored.origin) json["origin"] = *stored.origin;
  if (report.curvature_radius > 0) json["curvature_radius"] = report.curvature_radius;
  if (has_single_layout && baked.options.encoding.mips) json["mips"] = stored.mips;
  if (baked.planned) json["auto"] = plan_json(*baked.planned);
  if (outcome.asset.fitted) json["bytes"] = bytes_json(outcome);
  const PlannedLow* const planned = outcome.planned;
  if (planned != nullptr && !planned->byte_plan_result) {
    const std::string& screen = job.low.make.screen;
    json["plan"] = low_poly_plan_json(planned->plan,
                                      screen.empty() ? 0 : parse_pixels(option("screen"), screen));
  }
  if (!has_single_layout) json["sets"] = outcome.set_reports;
  if (planned != nullptr && planned->lods) json["lods"] = planned->lod_descriptions;
  if (!report.ids.empty()) json["ids"] = ids_json(report.ids);
  if (!stored.variant_ids.empty()) json["variant_ids"] = stored.variant_ids;
  if (!report.errors.empty()) {
    json["errors"] = describe(report.errors);
    json["seconds"]["errors"] = report.seconds_errors;
  }
  if (report.uv) json["uv"] = describe(*report.uv);
  if (report.views) json["views"] = describe(*report.views);
  if (outcome.match_inputs.parts()) json["parts"] = outcome.match_inputs.parts()->names;
  if (report.uv_copies > 0) {
    json["uv_copies"] = report.uv_copies;
    json["uv_copies_differ"] = report.uv_copies_differ;
  }
  if (report.small_triangles > 0) {
    json["small_charts"] = {{"triangles", report.small_triangles},
                            {"without_texel", report.small_triangles_without_texel}};
  }
  if (!scene.high.input.heights) json["high_normals"] = describe(scene.high.input.shading);
  if (clean_options(job)) json["clean"] = describe(scene.high.repairs);
  if (baked.reasons) json["reasons"] = reasons_json(*baked.reasons);
  if (report.cage_mesh) json["cage"] = describe(*report.cage_mesh);
  if (const std::optional<FoundCage>& cage = outcome.match_inputs.found_cage()) {
    json["cage"]["samples"] = cage->samples;
    json["cage"]["conflicts"] = cage->conflicts;
  }
  if (report.edges.edges != 0) json["hard_edges"] = describe(report.edges);
  if (report.recall) json["recall"] = describe(*report.recall);
  if (report.transitions) json["switches"] = describe(*report.transitions);
  if (report.transitions_blended) {
    json["switches_blended"] = describe(*report.transitions_blended);
    json["switches_blended"]["blended_texels"] = report.blended_texels;
  }
  if (report.visibility) json["visibility"] = describe(*report.visibility);
  if (!low.simplified) return;
  json["low"] = {{"faces", low.simplified->faces}, {"error", low.simplified->error}};
  json["low"]["flaws"] = describe_flaws(*low.simplified);
  if (!low.unwrapped) return;
  json["low"]["charts"] = low.unwrapped->charts;
  json["low"]["coverage"] = low.unwrapped->coverage;
  json["low"]["density_spread"] = low.unwrapped->density_spread;
}

/// Adds facts about the files of a given LOW, and the paths of HIGH's or LOW's files if there are several.
void add_input_files(const BakeScene& scene, Json& json) {
  const Job& job = scene.run.job;
  if (job.high.size() > 1) json["inputs"]["high"]["files"] = high_files(job);
  if (job.low.given.empty()) return;
  Json& low = json["inputs"]["low"];
  if (job.low.given.size() > 1) low["files"] = low_files(job);
  low["triangulation"] = name_of(Words(kTriangulationWords), job.load.triangulation);
  low["tangents"] = scene.low.mesh.tangents.empty() ? "mikktspace" : "file";
  low["quads"] = scene.low.polygons.quads;
  low["larger_polygons"] = scene.low.polygons.larger_polygons;
  low["soft_seams"] = scene.low.soft_seams;
}

}  // namespace

Json report_json(const RunOutcome& outcome, const Device& device, const Source& source) {
  const BakeScene& scene = outcome.scene;
  const Job& job = scene.run.job;
  const BakeReport& report = outcome.baked.result.report;
  const std::string& low = !job.low.given.empty()           ? low_name(job)
                           : !asset_file(job).empty()       ? asset_file(job)
                           : !outcome.outputs.files.empty() ? outcome.outputs.files[0]
                                                            : scene.low.stem;
  const MeshStream* const streamed = scene.high.streamed.get();
  const Json high = streamed != nullptr ? describe(*streamed, high_name(job))
                                        : describe(scene.high.mesh(), high_name(job));
  Json json = {{"version", version()},
               {"device", describe(device.info())},
               {"inputs", {{"high", high}, {"low", describe(scene.low.mesh, low)}}},
               {"options", describe(job, report)},
               {"seconds", seconds(outcome.seconds, report, outcome.total_seconds)},
               {"compile_seconds", device.compile_seconds()},
               {"texels", describe_texels(report)},
               {"distance",
                {{"mean", report.mean_abs_distance},
                 {"max_allowed", report.max_distance},
                 {"diagonal", source.stats().diagonal}}},
               {"source",
                {{"triangles", source.stats().triangles},
                 {"skipped", source.stats().skipped_triangles},
                 {"device_bytes", source.stats().device_bytes}}},
               {"memory",
                {{"peak_resident_bytes", peak_resident_bytes()},
                 {"peak_device_bytes", report.peak_device_bytes}}},
               {"outputs", outcome.outputs.files},
               {"warnings", describe(scene.run.log.warnings)}};
  add_optional_keys(outcome, json);
  add_input_files(scene, json);
  return json;
}

}  // namespace kiln
