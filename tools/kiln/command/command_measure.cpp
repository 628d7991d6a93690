#include <algorithm>
#include <map>
#include <memory>
#include <optional>

#include "arguments/bake_arguments.h"
#include "arguments/bake_values.h"
#include "arguments/dense_input.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "lab/plot.h"
#include "lab/rating.h"
#include "lab/study_output.h"
#include "picture/view_arguments.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/json_text.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, StudyKind> kStudies = {
    {"views", StudyKind::views}, {"faces", StudyKind::faces}, {"size", StudyKind::size}};

struct MeasureArguments {
  std::string high, low, study, out, json, device;
  std::string max_distance = "2%";
  std::vector<std::string> matches, visibility_at;
  std::optional<std::uint32_t> views, view_size, size, faces, directions;
  HeightArguments heights;
  ViewArguments view;
  std::optional<std::uint32_t> picture_size;
  bool quiet = false;
};

bool asks_for_view(const MeasureArguments& a) {
  return a.view.given() || a.view.square || a.picture_size.has_value();
}

/// Contradictions between several options.
void check(const MeasureArguments& a) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  if (!a.matches.empty() || a.directions || !a.visibility_at.empty()) {
    fail(
        "--match, --directions and --visibility-at are for rating ways to match: leave out "
        "--study, "
        "or them.");
  }
  if (a.out.empty()) fail("--study needs --out, a folder for its data and pictures.");
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
  if (asks_for_view(a)) {
    fail(
        "--view, --zoom, --at, --square and --picture-size are for rating matches: --study looks "
        "from a direction that nothing was matched from. Leave them out.");
  }
}

StudyOptions study_options(const MeasureArguments& a) {
  StudyOptions options;
  options.kind = kStudies.at(a.study);
  options.views = a.views.value_or(options.views);
  options.view_size = a.view_size.value_or(options.view_size);
  options.size = a.size.value_or(options.size);
  options.faces = a.faces.value_or(options.faces);
  options.z_up = a.view.z_up;
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
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
  json["height"] = is_height_field(a.high) ? Json(a.heights.height) : Json();
  json["extent"] = a.heights.extent.empty() ? Json() : Json(a.heights.extent);
  json["z_up"] = a.view.z_up;
  return json;
}

int run_one_study(const MeasureArguments& arguments) {
  check(arguments);
  const StudyOptions options = study_options(arguments);
  Console console(arguments.quiet, arguments.json);
  Stopwatch watch;
  const fs::path folder = arguments.out;
  prepare_output_folder(folder);
  if (!arguments.json.empty()) prepare_output_folder(fs::path(arguments.json).parent_path());

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

/// Without --study: every way to match asked for, rated on the two meshes.
int run_rating(const MeasureArguments& a) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  if (a.low.empty()) {
    fail(
        "To rate ways to match, both meshes are needed: kiln measure HIGH LOW. For one alone, say "
        "what is to be studied with --study.");
  }
  if (a.views || a.view_size || a.faces) {
    fail("--views, --view-size and --faces are for --study: leave them out.");
  }
  RatingOptions options;
  options.methods = a.matches.empty() ? match_names() : a.matches;
  for (const std::string& at : a.visibility_at) {
    options.visibility_at.push_back(visibility_at_values().at(at));
  }
  if (!a.visibility_at.empty() &&
      std::none_of(options.methods.begin(), options.methods.end(),
                   [](const std::string& name) { return find_match(name).takes_visibility; })) {
    fail("--visibility-at is for --match visibility and hybrid: add one of them, or leave it out.");
  }
  options.strict = !a.matches.empty();
  options.size = a.size.value_or(options.size);
  options.directions = a.directions.value_or(options.directions);
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  options.pictures = !a.out.empty();
  if (!options.pictures && asks_for_view(a)) {
    fail("--view, --zoom, --at, --square and --picture-size are for pictures: add --out DIR.");
  }
  options.view = view_options(a.view, is_height_field(a.high));
  options.view.size = a.picture_size.value_or(0);
  Console console(a.quiet, a.json);
  Stopwatch watch;
  const fs::path folder = a.out;
  std::vector<fs::path> files = {a.json};
  if (options.pictures) {
    for (const std::string& file : plot_files("measure")) files.push_back(folder / file);
  }
  check_paths({a.high, a.low}, files);
  if (options.pictures) prepare_output_folder(folder);
  if (!a.json.empty() && a.json != "-") prepare_parent(a.json);

  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const DenseInput dense = load_dense(a.high, a.heights, warnings);
  const Mesh& high = dense.mesh;
  options.uv = uv_options(dense);
  const Mesh low = load_light(a.low, "", warnings);
  const double seconds_load = watch.lap();
  const std::optional<Ratings> ratings =
      rate(device, high, low, options, [&](double done, std::string_view stage) {
        return console.progress(0.05 + 0.9 * done, stage);
      });
  if (!ratings) return kExitCancelled;
  warnings.insert(warnings.end(), ratings->warnings.begin(), ratings->warnings.end());
  const double seconds_rate = watch.lap();
  std::vector<std::string> outputs;
  if (options.pictures) {
    if (!console.progress(0.95, "writing")) return kExitCancelled;
    const auto save = [&](const Image& image, const std::string& name) {
      save_image(image, folder / name, {ImageFormat::exr_float});
      outputs.push_back((folder / name).string());
    };
    for (const Rating& row : ratings->rows) {
      const std::string stem = low.name + "_" + row.name;
      const AssessmentFields& fields = row.match.fields;
      save(fields.object_space, stem + "_object_space.exr");
      save(fields.image_space, stem + "_image_space.exr");
      save(fields.normalised_image_space, stem + "_normalised_image_space.exr");
      save(fields.uniformity, stem + "_uniformity.exr");
      save(fields.match_distance, stem + "_match_distance.exr");
      save(fields.stretch, stem + "_stretch.exr");
      if (row.recalled.empty()) continue;
      const fs::path colored = folder / (stem + "_recall.obj");
      save_obj(recall_mesh(high, row), colored);
      outputs.push_back(colored.string());
    }
    if (!save_plots(folder, {ratings_plot(*ratings)}, outputs, warnings)) return kExitCancelled;
  }
  if (!a.json.empty()) {
    Json json = {
        {"version", version()},
        {"device", cli::describe(device.info())},
        {"inputs", {{"high", cli::describe(high, a.high)}, {"low", cli::describe(low, a.low)}}},
        {"options",
         {{"match", options.methods},
          {"visibility_at", a.visibility_at},
          {"size", options.size},
          {"directions", options.directions},
          {"max_distance", a.max_distance},
          {"height", is_height_field(a.high) ? Json(a.heights.height) : Json()},
          {"extent", a.heights.extent.empty() ? Json() : Json(a.heights.extent)},
          {"view", {options.view.azimuth_degrees, options.view.elevation_degrees}},
          {"zoom", options.view.zoom},
          {"z_up", options.view.z_up}}}};
    json.update(cli::describe(*ratings));
    json["seconds"] = {{"load", seconds_load}, {"rate", seconds_rate}, {"total", watch.total()}};
    json["memory"] = {{"peak_resident_bytes", peak_resident_bytes()}};
    json["outputs"] = outputs;
    json["warnings"] = cli::describe(warnings);
    save_report(a.json, json);
  }
  console.progress(1, "done");
  std::vector<Warning> of_methods;
  for (const Rating& row : ratings->rows) {
    of_methods.insert(of_methods.end(), row.bake.warnings.begin(), row.bake.warnings.end());
  }
  print_warnings(console, warnings, of_methods, "--json");
  if (a.json != "-") {
    for (const std::string& line : ratings_table(*ratings)) console.line(line);
    for (const LeftOut& left : ratings->left_out) {
      console.line("left out: " + left.name + ": " + left.reason);
    }
    for (const std::string& output : outputs) console.line("wrote " + output);
  }
  return 0;
}

}  // namespace

Run add_measure(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "measure",
      "How good the ways to match are on two meshes; or, with --study, how errors depend on views, "
      "faces and map size");
  auto a = std::make_shared<MeasureArguments>();
  std::vector<std::string> names;
  for (const auto& [name, kind] : kStudies) names.push_back(name);
  command->add_option("HIGH", a->high, std::string("The dense mesh (") + kDenseKinds + ")")
      ->required();
  command->add_option(
      "LOW", a->low,
      "The light mesh, with UVs; with --study views it may be left out: Kiln makes one");
  command
      ->add_option(
          "--match", a->matches,
          "A way to match to rate, as of kiln bake; may be given again (default: all, but uv "
          "only where HIGH has UVs that lie over LOW's)")
      ->allow_extra_args(false)
      ->check(CLI::IsMember(match_names()));
  command
      ->add_option(
          "--visibility-at", a->visibility_at,
          "Rate visibility and hybrid with directions gathered here: face, vertex or texel; "
          "may be given again (default: texel)")
      ->allow_extra_args(false)
      ->check(one_of(visibility_at_values()));
  command
      ->add_option("--directions", a->directions,
                   "Directions that viewing rays come from (default 512)")
      ->check(CLI::Range(12U, 4096U));
  command
      ->add_option("--study", a->study,
                   "What varies: the views matched from, the light mesh's faces, or its faces and "
                   "the map's size")
      ->check(CLI::IsMember(names));
  command->add_option("--out", a->out,
                      "Folder for measure.png and the measures as textures (EXR); with --study for "
                      "study_<what>.csv and .png and study_<what>_error.png; and for what the "
                      "pictures show, ..._plot.json and .png");
  command->add_option("--views", a->views, "Depth views, where they do not vary (default 12)")
      ->check(CLI::Range(1U, 128U));
  command
      ->add_option("--view-size", a->view_size,
                   "Pixels a side of a depth view (default: by the density of HIGH)")
      ->check(CLI::Range(16U, 8192U));
  command
      ->add_option("--size", a->size,
                   "Texels a side (default 512; of a study, where they do not vary, 1024)")
      ->check(CLI::Range(16U, 8192U));
  command
      ->add_option("--faces", a->faces,
                   "--study views without LOW: triangles of the light mesh (default 2000)")
      ->check(CLI::Range(4U, 100000000U));
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  add_height_options(*command, a->heights, "The height field (HIGH is a PNG or EXR)");
  command
      ->add_option("--picture-size", a->picture_size,
                   "Pixels of a picture's longer side (default: by how much of it the mesh fills)")
      ->check(CLI::Range(64U, 4096U));
  add_view_options(*command, a->view);
  command->add_option("--device", a->device, "OpenCL device: index or part of its name");
  command->add_option("--json", a->json, "Write a report to this file");
  command->add_flag("--quiet", a->quiet,
                    "Leave out progress and the summary; warnings and errors stay");
  return [a] { return a->study.empty() ? run_rating(*a) : run_one_study(*a); };
}

}  // namespace kiln::cli
