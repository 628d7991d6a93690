// The report of a bake, as JSON.
#include "job/map_words.h"
#include "job/run.h"
#include "kiln/plan.h"
#include "options/parse.h"

namespace kiln {
namespace {

Json trial_json(const PlanTrial& trial) {
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
  for (const PlanTrial& trial : planned.trials) trials.push_back(trial_json(trial));
  Json limits = Json::array();
  for (const PlanLimit& limit : planned.limits) {
    limits.push_back({{"match", limit.method.name},
                      {"mean_angle_degrees", limit.error.mean_degrees},
                      {"p95_angle_degrees", limit.error.p95_degrees},
                      {"missed_share", limit.missed},
                      {"seconds", limit.seconds}});
  }
  return {{"chosen", trial_json(planned.chosen)},
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

Json seconds(const Stages& stages, const BakeReport& report, double total) {
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

/// Number of samples for each reason, with an example; the colour is that of NAME_reasons.png.
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

/// Keys that only some bakes have.
void add_parts(const BakeRun& run, Json& json) {
  const BakeReport& report = run.result.report;
  const LowMesh& low = run.low;
  // Values at 0 and 1 of integer formats, a channel each.
  if (!run.ranges.empty() && run.sets.empty()) json["ranges"] = run.ranges;
  if (!run.stored_errors.empty() && run.sets.empty()) json["stored_errors"] = run.stored_errors;
  if (run.origin) json["origin"] = *run.origin;
  if (report.curvature_radius > 0) json["curvature_radius"] = report.curvature_radius;
  if (run.options.encoding.mips && run.sets.empty()) json["mips"] = run.mips;
  if (run.planned) json["auto"] = plan_json(*run.planned);
  if (run.fitted) json["bytes"] = bytes_json(run);
  if (run.plan && !run.byte_plan) {
    const std::string& screen = run.arguments.low.make.screen;
    json["plan"] =
        low_poly_plan_json(*run.plan, screen.empty() ? 0 : parse_pixels(option("screen"), screen));
  }
  if (!run.sets.empty()) json["sets"] = run.set_reports;
  if (run.lods) json["lods"] = run.lod_levels;
  if (!report.ids.empty()) json["ids"] = ids_json(report.ids);
  if (!run.variant_ids.empty()) json["variant_ids"] = run.variant_ids;
  if (!report.errors.empty()) {
    json["errors"] = describe(report.errors);
    json["seconds"]["errors"] = report.seconds_errors;
  }
  if (report.uv) json["uv"] = describe(*report.uv);
  if (report.views) json["views"] = describe(*report.views);
  if (run.parts) json["parts"] = run.parts->names;
  if (report.uv_copies > 0) {
    json["uv_copies"] = report.uv_copies;
    json["uv_copies_differ"] = report.uv_copies_differ;
  }
  if (report.small_triangles > 0) {
    json["small_charts"] = {{"triangles", report.small_triangles},
                            {"without_texel", report.small_without_texel}};
  }
  if (!run.high.heights) json["high_normals"] = describe(run.high.shading);
  if (clean_options(run.arguments)) json["clean"] = describe(run.cleaned);
  if (run.reasons) json["reasons"] = reasons_json(*run.reasons);
  if (report.cage_mesh) json["cage"] = describe(*report.cage_mesh);
  if (run.cage) {
    json["cage"]["samples"] = run.cage->samples;
    json["cage"]["conflicts"] = run.cage->conflicts;
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

/// The user's LOW as it was read, and several files.
void add_files(const BakeRun& run, Json& json) {
  const Job& arguments = run.arguments;
  if (arguments.high.size() > 1) json["inputs"]["high"]["files"] = high_files(arguments);
  if (arguments.low.given.empty()) return;
  Json& low = json["inputs"]["low"];
  if (arguments.low.given.size() > 1) low["files"] = low_files(arguments);
  low["triangulation"] = name_of(Words(kTriangulations), arguments.load.triangulation);
  low["tangents"] = run.low.mesh.tangents.empty() ? "mikktspace" : "file";
  low["quads"] = run.low.polygons.quads;
  low["larger_polygons"] = run.low.polygons.larger;
  low["soft_seams"] = run.low.soft_seams;
}

}  // namespace

Json report_json(const BakeRun& run, const Device& device, const Source& source, double total) {
  const Job& arguments = run.arguments;
  const BakeReport& report = run.result.report;
  const std::string& low = !arguments.low.given.empty()     ? low_name(arguments)
                           : !asset_file(arguments).empty() ? asset_file(arguments)
                           : !run.outputs.empty()           ? run.outputs[0]
                                                            : run.low.stem;
  Json json = {{"version", version()},
               {"device", describe(device.info())},
               {"inputs",
                {{"high", describe(run.high_mesh(), high_name(arguments))},
                 {"low", describe(run.low.mesh, low)}}},
               {"options", describe(arguments, report)},
               {"seconds", seconds(run.stages, report, total)},
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
               {"outputs", run.outputs},
               {"warnings", describe(run.warnings)}};
  add_parts(run, json);
  add_files(run, json);
  return json;
}

}  // namespace kiln
