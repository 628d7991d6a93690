// Writes the summary of a bake: one line per topic.

#include "base/counted.h"
#include "base/percent.h"
#include "job/map_words.h"
#include "job/stages.h"
#include "job/streaming.h"
#include "kiln/plan.h"
#include "options/parse.h"

namespace kiln {
namespace {

std::string percent(std::uint64_t part, std::uint64_t whole) {
  return formatted(
      "%.2f%%", whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

/// Lists the matches that found points, with their shares: "outward 60.12%, inward 39.80%".
std::string describe_match_shares(const BakeReport& report) {
  std::string text;
  for (const auto& [name, count] :
       {std::pair{"outward", report.outward},
        std::pair{"outward past a nearer face", report.passed_over},
        std::pair{"inward", report.inward}, std::pair{"cage", report.cage},
        std::pair{"views", report.viewed}, std::pair{"closest", report.closest},
        std::pair{"UV", report.by_uv}}) {
    if (count == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(name) + " " + percent(count, report.samples);
  }
  return text.empty() ? "none" : text;
}

/// Summarises the views in one line.
std::string summary(const ViewReport& views, double diagonal) {
  std::string text;
  const std::size_t count = views.directions.size();
  text = formatted(
      "%zu view%s of %u x %u%s, a pixel is %.3g%% of the diagonal; %.1f%% of the high poly's area "
      "has smaller triangles",
      count, count == 1 ? "" : "s", views.size, views.size,
      views.height_field ? " (a height field)" : "", 100 * views.pixel / diagonal,
      100 * views.undersampled);
  std::string line = text;
  if (!views.coverage.empty()) {
    line += "; share of the surface seen after each view:";
    for (const double share : views.coverage) {
      line += formatted(" %.1f%%", 100 * share);
    }
  }
  return line;
}

/// Summarises visibility in one line.
std::string summary(const VisibilityReport& visibility, std::uint32_t clusters) {
  return formatted(
      "visibility from %u directions by %s at %s %s in %.2f s; %s are seen from none (%s of these "
      "have no seen neighbour, and keep the normal); standard deviation %.3f%s",
      visibility.directions, visibility.by_rays ? "rays" : "views",
      with_commas(visibility.places).c_str(), visibility.width != 0 ? "texels" : "vertices",
      visibility.seconds, with_commas(visibility.unseen).c_str(),
      with_commas(visibility.without).c_str(), visibility.mean_deviation,
      clusters > 1 ? ("; " + with_commas(visibility.clustered) + " split into clusters").c_str()
                   : "");
}

/// Names a trial's match and size, such as "rays, 512 x 512".
std::string describe_trial(const PlanTrial& trial) {
  return std::string(trial.method.name) + ", " + std::to_string(trial.width) + " x " +
         std::to_string(trial.height);
}

/// Summarises a plan of match and map in one line.
std::string summary(const PlannedBake& planned) {
  const std::string text = formatted(
      "chose %s: rendered normals deviate by %.3g degrees (mean over %u pictures of %u x %u; 95th "
      "percentile %.3g; without the map %.3g; requested %.3g)",
      describe_trial(planned.chosen).c_str(), planned.chosen.error.mean_degrees, kPlanViews,
      kPlanPixels, kPlanPixels, planned.chosen.error.p95_degrees, planned.without_map.mean_degrees,
      planned.wanted);
  std::string line = text;
  line += "; tried";
  for (const PlanTrial& trial : planned.trials) {
    line += formatted("%s %s: %.3g", &trial == planned.trials.data() ? "" : ";",
                      describe_trial(trial).c_str(), trial.error.mean_degrees);
  }
  line += "; with a map of unlimited size";
  for (const PlanLimit& limit : planned.limits) {
    line += formatted("%s %s: %.3g", &limit == planned.limits.data() ? "" : ";",
                      std::string(limit.method.name).c_str(), limit.error.mean_degrees);
  }
  if (planned.least > 0) {
    line += formatted("; with any match at least %.3g", planned.least);
  }
  return line;
}

/// Summarises the agreement of the UV layouts in one line.
std::string summary(const UvReport& uv, double diagonal) {
  return formatted(
      "layouts: %s of the high poly's samples are covered twice; surfaces at the same UV are %s of "
      "the diagonal apart on average, 95%% of the samples within %s",
      percent(uv.overlapping, uv.covered).c_str(),
      kiln::percent(uv.mean_distance / diagonal).c_str(),
      kiln::percent(uv.p95_distance / diagonal).c_str());
}

/// Summarises a cage in one line, such as "cage: 0.25% to 1.8% of the diagonal out, 0.25% to 0.6% in".
std::string summary(const CageReport& cage, double diagonal) {
  const double percent_of_diagonal = 100 / diagonal;
  const std::string text =
      formatted("cage: %.3g%% to %.3g%% of the diagonal outward",
                percent_of_diagonal * cage.min_outward, percent_of_diagonal * cage.max_outward);
  std::string line = text;
  if (cage.kind != CageKind::shells) return line;
  return line + formatted(", %.3g%% to %.3g%% inward", percent_of_diagonal * cage.min_inward,
                          percent_of_diagonal * cage.max_inward);
}

/// Summarises in one line within what distance of hard edges the directions of rays are blended.
std::string summary(const EdgeReport& edges, double diagonal) {
  const std::string text =
      formatted("hard edges: rays bend within %.3g%% of the diagonal (%.3g%% to %.3g%%)",
                100 * edges.median_width / diagonal, 100 * edges.min_width / diagonal,
                100 * edges.max_width / diagonal);
  if (edges.found == 0) return text;
  return text + ("; widths are those of HIGH's bevels at " + with_commas(edges.found) + " of " +
                 plural(edges.edges, "hard edge"));
}

/// States in one line how much of the visible high poly has a texel.
std::string summary(const HighCoverageReport& recall) {
  return formatted("recall: texels represent %.2f%% of HIGH's visible surface near LOW",
                   100 * (1 - recall.lost));
}

std::string set_prefix(const BakedSet& set) {
  return "texture set '" + set.word + "'" + (set.set.tile.empty() ? "" : ", tile " + set.set.tile) +
         ": ";
}

/// Adds a line for each reason except Reason::found. \param samples  number of all samples, for percentages
void add_reasons(RunLog& console, const Reasons& reasons, std::uint64_t samples,
                 const std::string& set = {}) {
  const auto infos = reason_infos();
  for (const ReasonCount& count : reasons.counts) {
    if (count.reason == Reason::found) continue;
    const ReasonInfo& info = infos[static_cast<std::size_t>(count.reason)];
    const std::string text =
        formatted(", such as at texel column %u, row %u (%.4g, %.4g, %.4g)", count.column,
                  count.row, count.position[0], count.position[1], count.position[2]);
    console.line(set + std::string(info.name) + ": " + plural(count.samples, "sample") + " (" +
                 percent(count.samples, samples) + ") " + info.words + text);
  }
}

std::string texels_line(const BakeReport& report, std::uint64_t map_texels,
                        const Source::Stats& source) {
  const std::uint64_t found = report.samples - report.missed;
  std::string search_text;
  if (report.max_distance > 0) {
    search_text =
        formatted(", search distance %.3g (%s)", report.max_distance,
                  format_share_of_diagonal(report.max_distance / source.diagonal).c_str());
  }
  return formatted(
      "%s of %s texels covered, %s matched (%s), %s samples missed (%s); mean distance "
      "%.3g units (%s)%s",
      with_commas(report.texels).c_str(), with_commas(map_texels).c_str(),
      percent(found, report.samples).c_str(), describe_match_shares(report).c_str(),
      with_commas(report.missed).c_str(), percent(report.missed, report.samples).c_str(),
      report.mean_abs_distance,
      format_share_of_diagonal(report.mean_abs_distance / source.diagonal).c_str(),
      search_text.c_str());
}

void add_texel_totals(RunLog& console, const BakeReport& report, std::uint64_t map_texels,
                      const Source::Stats& source, const StageSeconds& stages, double total) {
  if (map_texels > 0) console.line(texels_line(report, map_texels, source));
  console.line(formatted(
      "%.2f s: load %.2f, low poly %.2f, build %.2f, plan %.2f, texels %.2f, match %.2f, "
      "detail %.2f, recall %.2f, image %.2f, mip-maps %.2f, save %.2f; peak memory %llu MiB",
      total, stages.load, stages.low, stages.build + report.seconds_build, stages.plan,
      report.seconds_texels, report.seconds_match, report.seconds_detail, report.seconds_recall,
      report.seconds_image, report.seconds_mips, stages.save,
      static_cast<unsigned long long>(peak_resident_bytes() >> 20)));
}

}  // namespace

void add_summary(const RunOutcome& outcome, const Source::Stats& source) {
  const BakeScene& scene = outcome.scene;
  const BakedLayout& baked = outcome.baked;
  const Job& job = scene.run.job;
  const LowMesh& low = scene.low;
  const LowPolyPlan* const plan = outcome.planned != nullptr ? &outcome.planned->plan : nullptr;
  RunLog& console = scene.run.log;
  const BakeReport& report = baked.result.report;
  if (low.simplified) {
    console.line(formatted("low poly: %s of %s faces, within %.3f%% of the diagonal",
                           with_commas(low.simplified->faces).c_str(),
                           with_commas(low.simplified->input_faces).c_str(),
                           low.simplified->error * 100));
  }
  if (low.polygons.quads + low.polygons.larger_polygons > 0) {
    console.line("LOW: " + plural(low.polygons.quads, "quad") + " and " +
                 plural(low.polygons.larger_polygons, "larger polygon") +
                 ", triangulated by the rule '" +
                 name_of(Words(kTriangulationWords), job.load.triangulation) + "'");
  }
  if (!low.mesh.tangents.empty() && job.bake.encoding.space == NormalMapSpace::tangent) {
    console.line("LOW: tangents of its file (" + option("tangents", "mikktspace") +
                 " computes them)");
  }
  if (plan != nullptr && !outcome.planned->byte_plan_result) {
    for (const std::string& line : plan_table_lines(*plan)) console.line(line);
  }
  if (outcome.asset.fitted) {
    for (const std::string& line : bytes_table(outcome)) console.line(line);
  }
  if (plan != nullptr && outcome.planned->lods) {
    for (const std::string& line : lod_table(*outcome.planned->lods)) console.line(line);
  }
  const auto add_plan = [&](const std::string& set, const std::optional<PlannedBake>& planned) {
    if (!planned) return;
    console.line(set + summary(*planned));
    for (const MapReached& map : planned->bounds) console.line(set + describe(map));
  };
  add_plan("", baked.planned);
  for (const BakedSet& set : scene.sets) add_plan(set_prefix(set), set.planned);
  if (plan != nullptr) {
    for (const MapReached& map : plan->bounds) console.line(describe(map));
  }
  if (scene.high.streamed != nullptr) {
    console.line(streaming_line(scene.high.streamed->has_normals() ? "the file's" : "smooth"));
  } else if (const Message text = shading_line(scene.high.input.shading, job.frame.shading);
             !text.empty() && !scene.high.input.heights) {
    console.line(text);
  }
  if (report.views) console.line(summary(*report.views, source.diagonal));
  if (report.uv) console.line(summary(*report.uv, source.diagonal));
  if (outcome.match_inputs.parts()) {
    const std::uint64_t pairs = outcome.match_inputs.parts()->count;
    console.line(counted(pairs, "pair") + " of parts, " +
                 (pairs == 1 ? "matched separately" : "each matched separately"));
  }
  if (report.uv_copies > 0) {
    console.line("mirrored and repeated UVs: " + plural(report.uv_copies, "face") + " of LOW " +
                 (report.uv_copies == 1 ? "shares texels with a face that is baked"
                                        : "share texels with faces that are baked"));
  }
  if (report.cage_mesh) console.line(summary(*report.cage_mesh, source.diagonal));
  if (report.edges.edges != 0) console.line(summary(report.edges, source.diagonal));
  if (baked.reasons) add_reasons(console, *baked.reasons, report.samples);
  for (const BakedSet& set : scene.sets) {
    if (set.reasons) add_reasons(console, *set.reasons, report.samples, set_prefix(set));
  }
  if (report.recall && report.recall->places > 0) console.line(summary(*report.recall));
  if (report.visibility) {
    console.line(summary(*report.visibility, baked.options.match.visibility.clusters));
  }
  const std::uint64_t map_texels =
      plan != nullptr ? std::uint64_t{plan->chosen.size} * plan->chosen.size
      : baked.planned ? std::uint64_t{baked.planned->chosen.width} * baked.planned->chosen.height
                      : std::uint64_t{baked.options.width} * baked.options.height;
  std::uint64_t set_texels = 0;
  for (const BakedSet& set : scene.sets) set_texels += std::uint64_t{set.width} * set.height;
  add_texel_totals(console, report, scene.sets.empty() ? map_texels : set_texels, source,
                   outcome.seconds, outcome.total_seconds);
  for (const MapError& error : report.errors) {
    console.line(
        formatted("error of %s against %s: rms %.3g, mean %.3g, 95%% %.3g, max %.3g %s (%s texels)",
                  std::string(error.kind.name).c_str(), std::string(error.reference).c_str(),
                  error.rms, error.mean, error.p95, error.max, std::string(error.unit).c_str(),
                  with_commas(error.texels).c_str()));
  }
  for (const std::string& output : outcome.outputs.files) console.line("wrote " + output);
}

}  // namespace kiln
