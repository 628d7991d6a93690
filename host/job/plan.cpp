// A bake whose low poly, map and match are planned together.
#include "kiln/plan.h"

#include <algorithm>
#include <map>
#include <utility>

#include "job/job_options.h"
#include "job/map_words.h"
#include "job/stages.h"
#include "kiln/unwrap.h"
#include "options/parse.h"

namespace kiln {

LowPolyPlanOptions low_poly_options(const BakeScene& scene, const BakeOptions& bake) {
  const Job& a = scene.run.job;
  LowPolyPlanOptions options;
  const Message name = option(a.low.make.max_angle.empty() ? "max_error" : "max_angle");
  if (const std::string bound = angle_bound(a); !bound.empty()) {
    options.max_error = parse_degrees(name, bound);
  }
  options.bounds = map_bounds(a);
  options.choose_rays = !a.given.contains("--ao-rays");
  if (!a.low.make.screen.empty())
    options.screen = parse_pixels(option("screen"), a.low.make.screen);
  if (!a.low.make.max_outline.empty())
    options.max_outline = parse_outline_bound(a.low.make.max_outline);
  options.choose_match = a.match_auto;
  options.choose_samples = !a.given.contains("--samples");
  if (a.given.contains("--format")) {
    const bool bytes = holds_bytes(a.image);
    options.bits = bytes ? 8 : 16;
  }
  options.bake = bake;
  options.height_field = scene.high.input.heights.has_value();
  options.unwrap = unwrap_options(a.unwrap_method, options.bake.width).method;
  options.density = a.density;
  const bool normals_alone = options.bake.maps.size() == 1 && options.bake.transfers.empty() &&
                             options.bake.own_maps.empty() && options.bake.variants.empty();
  options.may_leave_map_out = normals_alone && a.packs.empty() && !a.layers && a.save_match.empty();
  return options;
}

namespace {

std::string size_text(std::uint32_t size) {
  return size == 0 ? "none" : std::to_string(size) + " x " + std::to_string(size);
}

std::string kib(std::uint64_t bytes) {
  return formatted("%.1f", static_cast<double>(bytes) / 1024);
}

std::string degrees(double angle) {
  return formatted(angle > 0 && angle < 0.001 ? "below 0.001" : "%.3g", angle);
}

bool same(const Candidate& a, const Candidate& b) { return a.faces == b.faces && a.size == b.size; }

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

Warning plan_not_reached(const LowPolyPlan& plan, const std::string& place) {
  if (plan.chosen.measured <= plan.wanted) {
    if (!(plan.max_outline > 0 && plan.chosen.silhouette_mismatch > plan.max_outline))
      return bounds_not_reached(plan.bounds, plan.chosen.size);
    const std::string differ = formatted(
        "Outlines differ by %.2g%% of what either mesh covers%s, more than the %.2g%% of ",
        100 * plan.chosen.silhouette_mismatch, place.c_str(), 100 * plan.max_outline);
    return {"outlines-not-reached",
            differ + option("max_outline") +
                ": no low poly that was looked at comes nearer. Accept more, or simplify with " +
                option("faces") + ".",
            1};
  }
  const std::string reached = formatted(
      " is expected to reach a mean error of %.3g degrees%s; what is written reaches %.3g. Allow a "
      "larger map, or accept more.",
      plan.wanted, place.c_str(), plan.chosen.measured);
  return {"error-not-reached", "No low poly with maps up to the given " + option("size") + reached,
          1};
}

Warning bounds_not_reached(const std::vector<MapReached>& bounds, std::uint32_t size) {
  Message text = "With maps of " + size_text(size) + " texels these are further off than " +
                 option("max_error") + " asks for:";
  for (const MapReached& map : bounds) {
    if (!map.reached()) text += " " + describe(map) + ".";
  }
  return {"error-not-reached",
          text + " Allow a larger " + option("size") + ", give more " + option("ao_rays") +
              " to maps of rays, or accept more.",
          1};
}

void warn_of_heavy_low(const Mesh& low, const Mesh& high, std::vector<Warning>& warnings) {
  const std::uint64_t vertices = split_vertices(low), dense = high.positions.size();
  if (2 * vertices <= dense) return;
  warnings.push_back({"low-heavy",
                      "The low poly has " + with_commas(vertices) +
                          " vertices, more than half of the high poly's " + with_commas(dense) +
                          ": ask for fewer faces, or accept more error.",
                      vertices});
}

void warn_of_outline(const LowPolyPlan& plan, const std::string& place,
                     std::vector<Warning>& warnings) {
  constexpr double kMuch = 0.05;
  const Candidate& chosen = plan.chosen;
  if (plan.max_outline > 0 || !(chosen.silhouette_mismatch > kMuch)) return;
  const std::string text = formatted(
      "The outlines of the low poly and the high poly differ%s: %.1f%% of what either "
      "covers, one alone does. Thin or small parts shrink or are lost, which rendered "
      "normals do not tell. Bound that (",
      place.c_str(), 100 * chosen.silhouette_mismatch);
  warnings.push_back(
      {"outlines", text + option("max_outline", "2%") + "), or ask for a smaller angle.", 1});
}

PlannedLow make_plan(const BakeScene& scene, const Source& source, const BakeOptions& bake) {
  LowPolyPlanOptions options = low_poly_options(scene, bake);
  watch_plan(scene, options);
  PlannedLow planned;
  planned.plan = plan_low_poly(source, scene.high.mesh(), options);
  if (planned.plan.cancelled) throw Cancelled{};
  std::vector<Warning>& warnings = scene.run.log.warnings;
  if (!planned.plan.reached) warnings.push_back(plan_not_reached(planned.plan));
  warn_of_outline(planned.plan, {}, warnings);
  return planned;
}

BakeResult take_plan(PlannedLow& planned, LowMesh& low) {
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

std::vector<std::string> trade_table(const LowPolyPlan& plan) {
  std::string text =
      formatted("%9s %9s %12s %10s %10s", "faces", "vertices", "map", "KiB", "degrees");
  std::vector<std::string> lines = {text};
  std::vector<Candidate> rows = plan.trade;
  std::erase_if(rows, [&](const Candidate& row) { return row.size == plan.chosen.size; });
  rows.push_back(plan.chosen);
  std::sort(rows.begin(), rows.end(),
            [](const Candidate& a, const Candidate& b) { return a.size < b.size; });
  for (const Candidate& row : rows) {
    Candidate known = row;
    for (const Candidate& trial : plan.candidates) {
      if (same(trial, row)) known = trial;
    }
    const bool made = known.measured >= 0;
    text = formatted("%9s %9s %12s %10s %10s  %s%s", with_commas(row.faces).c_str(),
                     with_commas(row.vertices).c_str(), size_text(row.size).c_str(),
                     kib(row.bytes.total()).c_str(),
                     degrees(made ? known.measured : row.expected).c_str(),
                     made ? ("measured, ± " + degrees(known.standard_error)).c_str() : "expected",
                     same(row, plan.chosen) ? "  <- chosen" : "");
    lines.emplace_back(text);
  }
  if (plan.max_outline > 0) {
    text = formatted("outlines differ by %.2g%% of what either mesh covers",
                     100 * plan.chosen.silhouette_mismatch);
    lines.emplace_back(text);
  }
  if (plan.chosen.size == 0 && plan.reached) {
    lines.push_back("no map needed: normals at the vertices are within " + degrees(plan.wanted) +
                    " degrees");
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

void watch_plan(const BakeScene& scene, LowPolyPlanOptions& options) {
  const RunHooks& hooks = scene.run.hooks;
  if (!hooks.on_plan) return;
  options.on_measured = [&hooks, stem = scene.low.stem](const LowPolyPlan& plan) {
    hooks.on_plan(plan, stem);
  };
}

}  // namespace kiln
