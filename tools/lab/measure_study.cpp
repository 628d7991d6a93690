// `kiln measure --study`: how errors depend on views, faces and map size.
#include <filesystem>

#include "arguments/parse.h"
#include "arguments/paths.h"
#include "interrupt.h"
#include "lab/measure_run.h"
#include "lab/study_output.h"
#include "picture/plot.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/json_text.h"
#include "report/report.h"

namespace kiln::cli {

const std::map<std::string, StudyKind>& study_kinds() {
  static const std::map<std::string, StudyKind> kinds = {
      {"views", StudyKind::views}, {"faces", StudyKind::faces}, {"size", StudyKind::size}};
  return kinds;
}

namespace {

namespace fs = std::filesystem;

/// Contradictions between several options.
void check(const MeasureArguments& a) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  if (!a.matches.empty() || a.directions || !a.visibility_at.empty()) {
    fail(
        "--match, --directions and --visibility-at are for rating matches: leave out "
        "--study, "
        "or them.");
  }
  if (a.out.empty()) fail("--study needs --out, a folder for its data and pictures.");
  if (!a.low.empty() && a.study != "views") {
    fail("--study " + a.study + " makes its own low polys, but LOW '" + a.low +
         "' was given: leave it out.");
  }
  if (!a.low.empty() && a.faces) {
    fail("--faces is for making a low poly, but LOW '" + a.low +
         "' was given: leave one of them out.");
  }
  const auto varies = [&](bool given, const char* option, bool is_varied) {
    if (given && is_varied) {
      fail("--study " + a.study + " varies " + option + " itself: leave the option out.");
    }
  };
  varies(a.views.has_value(), "--views", a.study == "views");
  varies(a.faces.has_value(), "--faces", a.study != "views");
  varies(a.size.has_value(), "--size", a.study == "size");
  if (a.asks_for_view()) {
    fail(
        "--view, --zoom, --at, --square and --picture-size are for rating matches: --study looks "
        "from a direction that nothing was matched from. Leave them out.");
  }
}

StudyOptions study_options(const MeasureArguments& a) {
  StudyOptions options;
  options.kind = study_kinds().at(a.study);
  options.views = a.views.value_or(options.views);
  options.view_size = a.view_size.value_or(options.view_size);
  options.size = a.size.value_or(options.size);
  options.faces = a.faces.value_or(options.faces);
  options.pixels = a.pixels.value_or(options.pixels);
  options.z_up = a.view.z_up;
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  return options;
}

/// Options in force; null: varied by the study, or not used.
Json json_of(const MeasureArguments& a, const StudyOptions& options) {
  Json json = {{"study", a.study}, {"max_distance", a.max_distance}};
  const bool views = options.kind == StudyKind::views;
  json["views"] = views ? Json() : Json(options.views);
  json["view_size"] = options.view_size == 0 ? Json("auto") : Json(options.view_size);
  json["size"] = options.kind == StudyKind::size ? Json() : Json(options.size);
  json["faces"] = views && a.low.empty() ? Json(options.faces) : Json();
  json["height"] = is_height_field(a.high) ? Json(a.heights.height) : Json();
  json["extent"] = a.heights.extent.empty() ? Json() : Json(a.heights.extent);
  json["z_up"] = a.view.z_up;
  return json;
}

}  // namespace

int run_one_study(const MeasureArguments& arguments) {
  check(arguments);
  const StudyOptions options = study_options(arguments);
  Console console(arguments.quiet, arguments.json);
  Stopwatch watch;
  const fs::path folder = arguments.out;
  prepare_output_folder(folder);
  prepare_parent(arguments.json);

  const Device device = Device::open(arguments.device);
  if (!console.progress(0, "reading " + arguments.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const Mesh high = load_dense(arguments.high, arguments.heights, warnings).mesh;
  std::optional<Mesh> low;
  if (!arguments.low.empty()) {
    low = load_light(arguments.low, ", or leave LOW out", warnings);
  }
  const double seconds_load = watch.lap();

  constexpr double kAtStudy = 0.02;
  constexpr double kAtSave = 0.97;
  const Study study = run_study(
      device, high, low ? &*low : nullptr, options, [&](double done, std::string_view stage) {
        return console.progress(kAtStudy + (kAtSave - kAtStudy) * done, stage);
      });
  if (study.cancelled) return kExitCancelled;
  warnings.insert(warnings.end(), study.warnings.begin(), study.warnings.end());
  const double seconds_study = watch.lap();

  const Plot plot = study_plot(study, options, high.name);
  if (!console.progress(kAtSave, "writing")) return kExitCancelled;
  const fs::path data = folder / (plot.name + ".csv");
  save_text(data, study_data(study));
  std::vector<std::string> outputs = {data.string()};
  if (!save_plots(folder, {plot, error_plot(study, options)}, outputs, warnings)) {
    return kExitCancelled;
  }
  const double seconds_save = watch.lap();

  if (!arguments.json.empty()) {
    Json inputs = {{"high", describe(high, arguments.high)}};
    inputs["low"] = low ? describe(*low, arguments.low) : Json();
    double bake = 0;
    double measure = 0;
    for (const Setting& setting : study.settings) {
      bake += setting.seconds_bake;
      measure += setting.seconds_measure;
    }
    Json json = {{"version", version()},
                 {"device", describe(device.info())},
                 {"inputs", inputs},
                 {"options", json_of(arguments, options)}};
    json.update(describe(study, options));
    add_ending(json,
               {{"load", seconds_load},
                {"low", study.seconds_low},
                {"bake", bake},
                {"measure", measure},
                {"study", seconds_study},
                {"save", seconds_save}},
               watch, outputs, warnings);
    save_text(arguments.json, to_text(json));
  }
  console.progress(1, "done");
  std::vector<Warning> of_settings;
  for (const Setting& setting : study.settings) {
    of_settings.insert(of_settings.end(), setting.warnings.begin(), setting.warnings.end());
  }
  print_warnings(console, warnings, of_settings, "--json");
  for (const Setting& setting : study.settings) {
    console.line(summary(setting, study.diagonal));
  }
  for (const std::string& line : findings(study, options)) console.line(line);
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace kiln::cli
