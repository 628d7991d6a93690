// A bake whose low poly, map and match are planned together.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "arguments/bake_values.h"
#include "arguments/map_bounds.h"
#include "arguments/parse.h"
#include "arguments/unwrap_option.h"
#include "command/bake_run.h"

namespace kiln::cli {

LightPlanOptions light_options(const BakeRun& run) {
  const BakeArguments& a = run.arguments;
  LightPlanOptions options;
  const char* flag = a.max_angle.empty() ? "--max-error" : "--max-angle";
  options.max_error = parse_degrees(flag, angle_bound(a));
  options.bounds = map_bounds(a);
  options.choose_rays = !a.given.contains("--ao-rays");
  if (!a.screen.empty()) options.screen = parse_pixels("--screen", a.screen);
  if (!a.max_outline.empty()) options.max_outline = parse_outline_bound(a.max_outline);
  options.choose_match = a.match == kAutomatic;
  options.choose_samples = !a.given.contains("--samples");
  if (a.given.contains("--format")) options.bits = a.format == "png8" ? 8 : 16;
  options.bake = run.options;
  options.height_field = run.dense.heights.has_value();
  options.unwrap = unwrap_options(a.unwrap_method, options.bake.width).method;
  if (a.density == kByDetail) options.density = TexelDensity::detail;
  const bool normals_alone = options.bake.maps.size() == 1 && options.bake.transfers.empty() &&
                             options.bake.own_maps.empty();
  options.may_leave_map_out = normals_alone && a.packs.empty() && !a.layers && a.save_match.empty();
  return options;
}

namespace {

std::string size_text(std::uint32_t size) {
  return size == 0 ? "none" : std::to_string(size) + " x " + std::to_string(size);
}

std::string kib(std::uint64_t bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", static_cast<double>(bytes) / 1024);
  return text;
}

std::string degrees(double angle) {
  char text[32];
  std::snprintf(text, sizeof text, angle > 0 && angle < 0.001 ? "below 0.001" : "%.3g", angle);
  return text;
}

bool same(const LightTrial& a, const LightTrial& b) {
  return a.faces == b.faces && a.size == b.size && a.laid_out_for == b.laid_out_for;
}

Json trial_json(const LightTrial& trial) {
  return {{"faces", trial.faces},
          {"positions", trial.positions},
          {"vertices", trial.vertices},
          {"charts", trial.charts},
          {"size", trial.size},
          {"laid_out_for", trial.laid_out_for},
          {"samples", trial.samples},
          {"bits", trial.bits},
          {"match", match_name(trial.method)},
          {"bytes",
           {{"vertices", trial.bytes.vertices},
            {"texels", trial.bytes.texels},
            {"total", trial.bytes.total()}}},
          {"expected_degrees", trial.expected},
          {"measured_degrees", trial.measured < 0 ? Json() : Json(trial.measured)},
          {"standard_error_degrees", trial.measured < 0 ? Json() : Json(trial.standard_error)},
          {"one_sided_share", trial.measured < 0 ? Json() : Json(trial.one_sided)}};
}

Json trials_json(const std::vector<LightTrial>& trials) {
  Json json = Json::array();
  for (const LightTrial& trial : trials) json.push_back(trial_json(trial));
  return json;
}

}  // namespace

Warning light_not_reached(const LightBake& light, const std::string& place) {
  char text[320];
  if (light.chosen.measured <= light.wanted) {
    if (!(light.max_outline > 0 && light.chosen.one_sided > light.max_outline))
      return bounds_not_reached(light.bounds, light.chosen.size);
    std::snprintf(text, sizeof text,
                  "Outlines differ by %s of what either mesh covers%s, more than the %s of "
                  "--max-outline: no low poly that was looked at comes nearer. Accept more, or "
                  "simplify with --faces.",
                  in_percent(light.chosen.one_sided).c_str(), place.c_str(),
                  in_percent(light.max_outline).c_str());
    return {"outlines-not-reached", text, 1};
  }
  std::snprintf(
      text, sizeof text,
      "No low poly with maps up to the given --size is expected to reach a mean error "
      "of %.3g degrees%s; what is written reaches %.3g. Allow a larger map, or accept more.",
      light.wanted, place.c_str(), light.chosen.measured);
  return {"error-not-reached", text, 1};
}

Warning bounds_not_reached(const std::vector<MapReached>& bounds, std::uint32_t size) {
  std::string text = "With maps of " + size_text(size) +
                     " texels these are further off than --max-error asks for:";
  for (const MapReached& map : bounds) {
    if (!map.reached()) text += " " + describe(map) + ".";
  }
  return {"error-not-reached",
          text + " Allow a larger --size, give more --ao-rays to maps of rays, or accept more.", 1};
}

void warn_of_heavy_low(const Mesh& low, const Mesh& high, std::vector<Warning>& warnings) {
  const std::uint64_t light = split_vertices(low), dense = high.positions.size();
  if (2 * light <= dense) return;
  warnings.push_back({"low-heavy",
                      "The low poly has " + with_commas(light) +
                          " vertices, more than half of the high poly's " + with_commas(dense) +
                          ": ask for fewer faces, or accept more error.",
                      light});
}

void warn_of_outline(const LightBake& light, const std::string& place,
                     std::vector<Warning>& warnings) {
  constexpr double kMuch = 0.05;
  const LightTrial& chosen = light.chosen;
  if (light.max_outline > 0 || !(chosen.one_sided > kMuch)) return;
  char text[320];
  std::snprintf(text, sizeof text,
                "The outlines of the low poly and the high poly differ%s: %.1f%% of what either "
                "covers, one alone does. Thin or small parts shrink or are lost, which rendered "
                "normals do not tell. Bound that (--max-outline 2%%), or ask for a smaller angle.",
                place.c_str(), 100 * chosen.one_sided);
  warnings.push_back({"outlines", text, 1});
}

bool make_light(BakeRun& run, const Source& source) {
  LightPlanOptions options = light_options(run);
  draw_at_once(run, options);
  LightBake planned = bake_light(source, run.dense.mesh, options);
  if (planned.cancelled) return false;
  take_light(run, std::move(planned));
  if (!run.light->reached) run.warnings.push_back(light_not_reached(*run.light));
  warn_of_outline(*run.light, {}, run.warnings);
  return true;
}

void take_light(BakeRun& run, LightBake planned) {
  run.light = std::move(planned);
  LightBake& light = *run.light;
  run.low.mesh = light.low;
  run.low.mesh.name = run.low.stem;
  run.low.simplified = light.simplified;
  run.low.unwrapped = light.unwrapped;
  if (!run.arguments.given.contains("--format")) {
    run.arguments.format = light.chosen.bits == 8 ? "png8" : "png16";
    run.save_options = image_options(run.arguments);
  }
  if (light.result) run.result = std::move(*light.result);
  light.result.reset();
}

std::vector<std::string> trade_table(const LightBake& light) {
  char text[256];
  std::snprintf(text, sizeof text, "%9s %9s %12s %10s %10s", "faces", "vertices", "map", "KiB",
                "degrees");
  std::vector<std::string> lines = {text};
  std::vector<LightTrial> rows = light.trade;
  std::erase_if(rows, [&](const LightTrial& row) { return row.size == light.chosen.size; });
  rows.push_back(light.chosen);
  std::sort(rows.begin(), rows.end(),
            [](const LightTrial& a, const LightTrial& b) { return a.size < b.size; });
  for (const LightTrial& row : rows) {
    LightTrial known = row;
    for (const LightTrial& trial : light.trials) {
      if (same(trial, row)) known = trial;
    }
    const bool made = known.measured >= 0;
    std::snprintf(text, sizeof text, "%9s %9s %12s %10s %10s  %s%s", with_commas(row.faces).c_str(),
                  with_commas(row.vertices).c_str(), size_text(row.size).c_str(),
                  kib(row.bytes.total()).c_str(),
                  degrees(made ? known.measured : row.expected).c_str(),
                  made ? ("measured, ± " + degrees(known.standard_error)).c_str() : "expected",
                  same(row, light.chosen) ? "  <- chosen" : "");
    lines.emplace_back(text);
  }
  if (light.max_outline > 0) {
    std::snprintf(text, sizeof text, "outlines differ by %s of what either mesh covers",
                  in_percent(light.chosen.one_sided).c_str());
    lines.emplace_back(text);
  }
  if (light.chosen.size == 0 && light.reached) {
    lines.push_back("no map needed: normals at the vertices are within " + degrees(light.wanted) +
                    " degrees");
  }
  return lines;
}

Json light_json(const LightBake& light, std::uint32_t screen) {
  Json levels = Json::array();
  for (const LightLevel& level : light.levels) {
    levels.push_back({{"faces", level.faces},
                      {"positions", level.positions},
                      {"without_map_degrees", level.without_map},
                      {"limit_degrees", level.limit}});
  }
  return {{"wanted_degrees", light.wanted},
          {"max_outline", light.max_outline > 0 ? Json(light.max_outline) : Json()},
          {"reached", light.reached},
          {"screen", screen == 0 ? Json() : Json(screen)},
          {"views", kPlanViews},
          {"chosen", trial_json(light.chosen)},
          {"trials", trials_json(light.trials)},
          {"trade", trials_json(light.trade)},
          {"levels", levels},
          {"bounds", bounds_json(light.bounds)},
          {"seconds",
           {{"simplify", light.seconds_simplify},
            {"unwrap", light.seconds_unwrap},
            {"measure", light.seconds_measure}}}};
}

namespace {

/// Maps that weigh more than so many times what was chosen are not drawn.
constexpr std::uint64_t kDrawn = 16;

Plot light_plot(const LightBake& light, const std::string& stem) {
  Json panel = {{"y_title", "Mean angle between rendered normals, degrees"},
                {"curves", Json::array()},
                {"levels", Json::array()}};
  char text[96];
  std::snprintf(text, sizeof text, "wanted: %.3g degrees", light.wanted);
  panel["levels"].push_back({{"title", text}, {"look", "none"}, {"y", light.wanted}});
  std::vector<std::uint32_t> sizes;
  double least = 1e300, most = 0;
  for (const LightTrial& trial : light.outlook) {
    if (trial.bytes.total() <= kDrawn * light.chosen.bytes.total()) sizes.push_back(trial.size);
  }
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(sizes.size());
    Json curve = {{"title", sizes[i] == 0 ? "no map" : std::to_string(sizes[i]) + "² texels"},
                  {"look", share},
                  {"x", Json::array()},
                  {"y", Json::array()}};
    for (const LightTrial& trial : light.outlook) {
      if (trial.size != sizes[i]) continue;
      const double size = static_cast<double>(trial.bytes.total()) / 1024;
      curve["x"].push_back(size);
      curve["y"].push_back(trial.expected);
      least = std::min(least, size);
      most = std::max(most, size);
    }
    panel["curves"].push_back(std::move(curve));
  }
  std::snprintf(text, sizeof text, "chosen: %s faces, map: %s",
                with_commas(light.chosen.faces).c_str(), size_text(light.chosen.size).c_str());
  panel["rings"] = {{"title", text},
                    {"x", {static_cast<double>(light.chosen.bytes.total()) / 1024}},
                    {"y", {light.chosen.measured}}};
  // Powers of four around all of it.
  Json ticks = Json::array();
  double tick = 1.0 / 256;
  while (4 * tick <= least) tick *= 4;
  for (; ticks.size() < 2 || ticks.back().number() < most; tick *= 4) ticks.push_back(tick);
  Plot plot;
  plot.name = stem + "_plan";
  plot.data = {{"kind", "study"},
               {"title", "Faces against texels: " + stem},
               {"x_title", "KiB of low poly and maps"},
               {"x_ticks", std::move(ticks)},
               {"panels", Json::array({panel})}};
  return plot;
}

}  // namespace

void draw_at_once(BakeRun& run, LightPlanOptions& options) {
  options.on_measured = [&run](const LightBake& light) {
    if (run.python && run.python->began()) run.python = start_python();
    if (run.python) begin_plot(*run.python, light_plot(light, run.low.stem));
  };
}

bool save_light_plot(BakeRun& run) {
  return save_plots(run.arguments.out, {light_plot(*run.light, run.low.stem)}, run.outputs,
                    run.warnings, std::move(run.python));
}

}  // namespace kiln::cli
