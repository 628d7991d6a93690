#include <map>
#include <memory>
#include <optional>

#include "check_result.h"
#include "commands.h"
#include "console.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "parse.h"
#include "plot.h"
#include "report.h"
#include "study_output.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, StudyKind> kStudies = {
    {"views", StudyKind::views}, {"faces", StudyKind::faces}, {"size", StudyKind::size}};

struct MeasureArguments {
  std::string high, low, study, out, json, device;
  std::string max_distance = "2%";
  std::optional<std::uint32_t> views, view_size, size, faces;
  bool z_up = false, quiet = false;
};

/// Contradictions between several options.
void check(const MeasureArguments& a) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  if (!a.low.empty() && a.study != "views") {
    fail("--study " + a.study + " makes its own light meshes, but LOW '" + a.low +
         "' was given: leave it out.");
  }
  if (!a.low.empty() && a.faces) {
    fail("--faces is for making a light mesh, but LOW '" + a.low +
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
}

StudyOptions study_options(const MeasureArguments& a) {
  StudyOptions options;
  options.kind = kStudies.at(a.study);
  options.views = a.views.value_or(options.views);
  options.view_size = a.view_size.value_or(options.view_size);
  options.size = a.size.value_or(options.size);
  options.faces = a.faces.value_or(options.faces);
  options.z_up = a.z_up;
  options.max_distance = parse_reach(a.max_distance);
  return options;
}

/// Options in force; null: varied by the study, or not used.
Json describe(const MeasureArguments& a, const StudyOptions& options) {
  Json json = {{"study", a.study}, {"max_distance", a.max_distance}};
  const bool views = options.kind == StudyKind::views;
  json["views"] = views ? Json() : Json(options.views);
  json["view_size"] = options.view_size == 0 ? Json("auto") : Json(options.view_size);
  json["size"] = options.kind == StudyKind::size ? Json() : Json(options.size);
  json["faces"] = views && a.low.empty() ? Json(options.faces) : Json();
  json["z_up"] = a.z_up;
  return json;
}

int run_one_study(const MeasureArguments& arguments) {
  check(arguments);
  const StudyOptions options = study_options(arguments);
  Console console(arguments.quiet);
  Stopwatch watch;
  const fs::path folder = arguments.out;
  prepare_output_folder(folder);
  if (!arguments.json.empty()) prepare_output_folder(fs::path(arguments.json).parent_path());

  const Device device = Device::open(arguments.device);
  if (!console.progress(0, "reading " + arguments.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const Mesh high = load_mesh(arguments.high, &warnings);
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

  const std::string name = std::string("study_") + study_name(options.kind);
  const Image picture = study_picture(study);
  if (!console.progress(kAtSave, "writing")) return kExitCancelled;
  std::vector<std::string> outputs;
  const auto saved = [&](const std::string& file) { outputs.push_back((folder / file).string()); };
  save_text(folder / (name + ".csv"), study_data(study));
  saved(name + ".csv");
  save_text(folder / (name + ".gp"), study_script(study, options, high.name));
  saved(name + ".gp");
  save_image(picture, folder / (name + "_error.png"), {ImageFormat::png8});
  saved(name + "_error.png");
  const std::string no_plot = draw_plot(folder, name);
  if (interrupted()) return kExitCancelled;
  if (no_plot.empty()) {
    saved(name + ".png");
  } else {
    warnings.push_back({"no-plot", no_plot, 1});
  }
  const double seconds_save = watch.lap();

  if (!arguments.json.empty()) {
    Json inputs = {{"high", cli::describe(high, arguments.high)}};
    inputs["low"] = low ? cli::describe(*low, arguments.low) : Json();
    double bake = 0;
    double measure = 0;
    for (const Setting& setting : study.settings) {
      bake += setting.seconds_bake;
      measure += setting.seconds_measure;
    }
    Json json = {{"version", version()},
                 {"device", cli::describe(device.info())},
                 {"inputs", inputs},
                 {"options", describe(arguments, options)}};
    json.update(cli::describe(study, options));
    json["seconds"] = {{"load", seconds_load},  {"low", study.seconds_low}, {"bake", bake},
                       {"measure", measure},    {"study", seconds_study},   {"save", seconds_save},
                       {"total", watch.total()}};
    json["memory"] = {{"peak_resident_bytes", peak_resident_bytes()}};
    json["outputs"] = outputs;
    json["warnings"] = cli::describe(warnings);
    save_text(arguments.json, json.dump(2) + "\n");
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

}  // namespace

Run add_measure(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "measure", "How errors depend on views, faces and map size: data, plots and pictures");
  auto a = std::make_shared<MeasureArguments>();
  std::vector<std::string> names;
  for (const auto& [name, kind] : kStudies) names.push_back(name);
  command->add_option("HIGH", a->high, "The dense mesh (PLY, OBJ, STL, OFF)")->required();
  command->add_option("LOW", a->low,
                      "--study views: the light mesh, with UVs; left out, Kiln makes one");
  command
      ->add_option("--study", a->study,
                   "What varies: the views matched from, the light mesh's faces, or its faces and "
                   "the map's size")
      ->check(CLI::IsMember(names))
      ->required();
  command
      ->add_option("--out", a->out,
                   "Folder for study_<what>.csv, .gp, .png and study_<what>_error.png")
      ->required();
  command->add_option("--views", a->views, "Depth views, where they do not vary (default 12)")
      ->check(CLI::Range(1U, 128U));
  command
      ->add_option("--view-size", a->view_size,
                   "Pixels a side of a depth view (default: by the density of HIGH)")
      ->check(CLI::Range(16U, 8192U));
  command->add_option("--size", a->size, "Texels a side, where they do not vary (default 1024)")
      ->check(CLI::Range(16U, 8192U));
  command
      ->add_option("--faces", a->faces,
                   "--study views without LOW: triangles of the light mesh (default 2000)")
      ->check(CLI::Range(4U, 100000000U));
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  command->add_flag("--z-up", a->z_up, "The error picture's up axis is +Z (default +Y)");
  command->add_option("--device", a->device, "OpenCL device: index or part of its name");
  command->add_option("--json", a->json, "Write a report to this file");
  command->add_flag("--quiet", a->quiet, "Print nothing but errors");
  return [a] { return run_one_study(*a); };
}

}  // namespace kiln::cli
