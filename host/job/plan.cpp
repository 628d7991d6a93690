// Plans and bakes jobs whose low poly, map and match are planned together.
#include "kiln/plan.h"

#include <algorithm>
#include <map>
#include <utility>

#include "job/job_options.h"
#include "job/map_words.h"
#include "job/stages.h"
#include "options/parse.h"

namespace kiln {

LowPolyPlanOptions low_poly_options(const BakeScene& scene, const BakeOptions& bake) {
  const Job& job = scene.run.job;
  LowPolyPlanOptions options;
  const Message name = option(job.low.make.max_angle.empty() ? "max_error" : "max_angle");
  if (const std::string bound = angle_bound(job); !bound.empty()) {
    options.max_error = parse_degrees(name, bound);
  }
  options.bounds = map_bounds(job);
  options.choose_rays = !job.given.contains("--ao-rays");
  if (!job.low.make.screen.empty())
    options.screen = parse_pixels(option("screen"), job.low.make.screen);
  if (!job.low.make.max_outline.empty())
    options.max_outline = parse_outline_bound(job.low.make.max_outline);
  options.choose_match = job.match_auto;
  options.choose_samples = !job.given.contains("--samples");
  if (job.given.contains("--format")) {
    const bool bytes = stores_8_bits(job.image);
    options.bits = bytes ? 8 : 16;
  }
  options.bake = bake;
  options.height_field = scene.high.input.heights.has_value();
  options.unwrap = unwrap_options(job.unwrap_method, options.bake.width).method;
  options.density = job.density;
  const bool bakes_only_normals = options.bake.maps.size() == 1 && options.bake.transfers.empty() &&
                                  options.bake.own_maps.empty() && options.bake.variants.empty();
  options.may_leave_map_out =
      bakes_only_normals && job.packs.empty() && !job.layers && job.save_match.empty();
  return options;
}

namespace {

std::string format_size(std::uint32_t size) {
  return size == 0 ? "none" : std::to_string(size) + " x " + std::to_string(size);
}

std::string format_kib(std::uint64_t bytes) {
  return formatted("%.1f", static_cast<double>(bytes) / 1024);
}

std::string format_degrees(double angle) {
  return formatted(angle > 0 && angle < 0.001 ? "below 0.001" : "%.3g", angle);
}

bool is_same_candidate(const Candidate& a, const Candidate& b) {
  return a.faces == b.faces && a.size == b.size;
}

Json trial_json(const Candidate& trial) {
  return {{"faces", trial.faces},
          {"positions", trial.positions},
          {"vertices", trial.vertices},
          {"charts", trial.charts},
          {"size", trial.size},
          {"samples", trial.samples},
          {"bits", trial.bits},
          {"match", trial.method.name},
          {"bytes",
           {{"vertices", trial.bytes.vertices},
            {"texels", trial.bytes.texels},
            {"total", trial.bytes.total()}}},
          {"expected_degrees", trial.expected},
          {"measured_degrees", trial.measured < 0 ? Json() : Json(trial.measured)},
          {"standard_error_degrees", trial.measured < 0 ? Json() : Json(trial.standard_error)},
          {"one_sided_share", trial.measured < 0 ? Json() : Json(trial.silhouette_mismatch)}};
}

Json trials_json(const std::vector<Candidate>& trials) {
  Json json = Json::array();
  for (const Candidate& trial : trials) json.push_back(trial_json(trial));
  return json;
}

}  // namespace

Warning plan_bound_warning(const LowPolyPlan& plan, const std::string& place) {
  if (plan.chosen.measured <= plan.wanted) {
    if (!(plan.max_outline > 0 && plan.chosen.silhouette_mismatch > plan.max_outline))
      return map_bounds_warning(plan.bounds, plan.chosen.size);
    const std::string mismatch = formatted(
        "Outlines differ by %.2g%% of the pixels that either mesh covers%s, more than the %.2g%% "
        "of ",
        100 * plan.chosen.silhouette_mismatch, place.c_str(), 100 * plan.max_outline);
    return {"outlines-not-reached",
            mismatch + option("max_outline") +
                ": no low poly that was tried differs less. Allow a larger difference, or simplify "
                "with " +
                option("faces") + ".",
            1};
  }
  const std::string reached = formatted(
      " is expected to reach a mean error of %.3g degrees%s; the one written reaches %.3g. Allow a "
      "larger map, or a larger error.",
      plan.wanted, place.c_str(), plan.chosen.measured);
  return {"error-not-reached", "No low poly with maps up to the given " + option("size") + reached,
          1};
}

Warning map_bounds_warning(const std::vector<MapReached>& bounds, std::uint32_t size) {
  Message text = "With maps of " + format_size(size) +
                 " texels, these maps exceed the errors that " + option("max_error") + " allows:";
  for (const MapReached& map : bounds) {
    if (!map.reached()) text += " " + describe(map) + ".";
  }
  return {"error-not-reached",
          text + " Allow a larger " + option("size") + ", give more " + option("ao_rays") +
              " to maps that use them, or allow larger errors.",
          1};
}

void warn_of_heavy_low(const Mesh& low, const Mesh& high, std::vector<Warning>& warnings) {
  const std::uint64_t vertices = split_vertices(low);
  if (2 * vertices <= high.positions.size()) return;
  // The vertices of both meshes are counted after splits at hard edges and seams.
  const std::uint64_t high_vertices = split_vertices(high);
  if (2 * vertices <= high_vertices) return;
  warnings.push_back({"low-heavy",
                      "The low poly has " + with_commas(vertices) +
                          " vertices, more than half of the high poly's " +
                          with_commas(high_vertices) +
                          ": use fewer faces, or allow a larger error.",
                      vertices});
}

void warn_of_outline(const LowPolyPlan& plan, const std::string& place,
                     std::vector<Warning>& warnings) {
  constexpr double kMaxSilhouetteMismatch = 0.05;
  const Candidate& chosen = plan.chosen;
  if (plan.max_outline > 0 || !(chosen.silhouette_mismatch > kMaxSilhouetteMismatch)) return;
  const std::string text = formatted(
      "The outlines of the low poly and the high poly differ%s: of the pixels that either covers, "
      "%.1f%% are covered by only one of them. Thin or small parts shrink or are lost, which "
      "rendered normals do not show. Limit this (",
      place.c_str(), 100 * chosen.silhouette_mismatch);
  warnings.push_back(
      {"outlines", text + option("max_outline", "2%") + "), or use a smaller angle.", 1});
}

PlannedLow make_plan(const BakeScene& scene, const Source& source, const BakeOptions& bake) {
  LowPolyPlanOptions options = low_poly_options(scene, bake);
  forward_plan_to_hook(scene, options);
  PlannedLow planned;
  planned.plan = plan_low_poly(source, scene.high.mesh(), options);
  if (planned.plan.cancelled) throw Cancelled{};
  std::vector<Warning>& warnings = scene.run.log.warnings;
  if (!planned.plan.reached) warnings.push_back(plan_bound_warning(planned.plan));
  warn_of_outline(planned.plan, {}, warnings);
  return planned;
}

BakeResult move_plan_result(PlannedLow& planned, LowMesh& low) {
  LowPolyPlan& plan = planned.plan;
  low.mesh = plan.low;
  low.mesh.name = low.stem;
  low.simplified = plan.simplified;
  low.unwrapped = plan.unwrapped;
  BakeResult result;
  if (plan.result) result = std::move(*plan.result);
  plan.result.reset();
  return result;
}

std::vector<std::string> plan_table_lines(const LowPolyPlan& plan) {
  std::string text =
      formatted("%9s %9s %12s %10s %10s", "faces", "vertices", "map", "KiB", "degrees");
  std::vector<std::string> lines = {text};
  std::vector<Candidate> rows = plan.trade;
  std::erase_if(rows, [&](const Candidate& row) { return row.size == plan.chosen.size; });
  rows.push_back(plan.chosen);
  std::sort(rows.begin(), rows.end(),
            [](const Candidate& a, const Candidate& b) { return a.size < b.size; });
  for (const Candidate& row : rows) {
    Candidate measured_row = row;
    for (const Candidate& trial : plan.candidates) {
      if (is_same_candidate(trial, row)) measured_row = trial;
    }
    const bool is_measured = measured_row.measured >= 0;
    text = formatted("%9s %9s %12s %10s %10s  %s%s", with_commas(row.faces).c_str(),
                     with_commas(row.vertices).c_str(), format_size(row.size).c_str(),
                     format_kib(row.bytes.total()).c_str(),
                     format_degrees(is_measured ? measured_row.measured : row.expected).c_str(),
                     is_measured
                         ? ("measured, ± " + format_degrees(measured_row.standard_error)).c_str()
                         : "expected",
                     is_same_candidate(row, plan.chosen) ? "  <- chosen" : "");
    lines.emplace_back(text);
  }
  if (plan.max_outline > 0) {
    text = formatted("outlines differ by %.2g%% of the pixels that either mesh covers",
                     100 * plan.chosen.silhouette_mismatch);
    lines.emplace_back(text);
  }
  if (plan.chosen.size == 0 && plan.reached) {
    lines.push_back("no map needed: normals at the vertices are within " +
                    format_degrees(plan.wanted) + " degrees");
  }
  return lines;
}

Json low_poly_plan_json(const LowPolyPlan& plan, std::uint32_t screen) {
  Json levels = Json::array();
  for (const PlanLevel& level : plan.levels) {
    levels.push_back({{"faces", level.faces},
                      {"positions", level.positions},
                      {"without_map_degrees", level.without_map},
                      {"limit_degrees", level.limit}});
  }
  return {{"wanted_degrees", plan.wanted},
          {"max_outline", plan.max_outline > 0 ? Json(plan.max_outline) : Json()},
          {"reached", plan.reached},
          {"screen", screen == 0 ? Json() : Json(screen)},
          {"views", kPlanViews},
          {"chosen", trial_json(plan.chosen)},
          {"trials", trials_json(plan.candidates)},
          {"trade", trials_json(plan.trade)},
          {"levels", levels},
          {"bounds", bounds_json(plan.bounds)},
          {"seconds",
           {{"simplify", plan.seconds_simplify},
            {"unwrap", plan.seconds_unwrap},
            {"measure", plan.seconds_measure}}}};
}

void forward_plan_to_hook(const BakeScene& scene, LowPolyPlanOptions& options) {
  const RunHooks& hooks = scene.run.hooks;
  if (!hooks.on_plan) return;
  options.on_measured = [&hooks, stem = scene.low.stem](const LowPolyPlan& plan) {
    hooks.on_plan(plan, stem);
  };
}

}  // namespace kiln
