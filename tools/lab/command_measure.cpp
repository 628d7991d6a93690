#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "arguments/bake_arguments.h"
#include "arguments/bake_values.h"
#include "arguments/dense_input.h"
#include "arguments/match_flags.h"
#include "arguments/option_table.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "arguments/transfers.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "lab/measuring.h"
#include "lab/rating.h"
#include "lab/study.h"
#include "lab/table.h"
#include "picture/plot.h"
#include "picture/view_arguments.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/json_text.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& text) { throw Error(ErrorCode::usage, text); }

struct MeasureArguments {
  std::string high, low, study, out, json, device;
  std::string max_distance = "2%";
  bool distance_given = false;
  BakeArguments bake;                    // flags of the match and of maps, all but those below
  std::set<std::string> matching_flags;  // their names
  std::vector<std::string> matches, visibility_at;
  std::optional<std::uint32_t> views, view_size, size, faces, directions, pixels;
  HeightArguments heights;
  ViewArguments view;
  std::optional<std::uint32_t> picture_size;
  bool quiet = false;

  /// Whether something says how pictures are taken.
  bool asks_for_view() const { return view.given() || view.square || picture_size.has_value(); }
};

const std::map<std::string, StudyKind>& study_kinds() {
  static const std::map<std::string, StudyKind> kinds = {
      {"views", StudyKind::views}, {"faces", StudyKind::faces}, {"size", StudyKind::size}};
  return kinds;
}

// ---- one mesh's UVs ----------------------------------------------------------------------------

std::vector<std::string> lines_of(const LayoutRating& r, std::uint32_t size) {
  const std::string charts = with_commas(r.charts), seams = with_commas(r.seams);
  const std::string triangles = with_commas(r.triangles), mirrored = with_commas(r.mirrored);
  return {formatted("stretch (1 is none): L2 %.3f, Linf %.3f", r.stretch_l2, r.stretch_linf),
          formatted("uniformity:          %.1f%%", r.uniformity_percent),
          formatted("texels a unit:       %.4g least, %.4g mean, %.4g most at %u x %u",
                    r.least_density, r.mean_density, r.greatest_density, size, size),
          formatted("charts:              %s, with seams of %s edges, %.4g units long",
                    charts.c_str(), seams.c_str(), r.seam_length),
          formatted("used:                %.1f%% of the square, %.2g%% of that more than once",
                    100 * r.used, 100 * r.overlap),
          formatted("triangles:           %s, %s of them mirrored; %s without texels",
                    triangles.c_str(), mirrored.c_str(), with_commas(r.flat).c_str())};
}

int rate_one_layout(const MeasureArguments& a) {
  Console console(a.quiet, a.json);
  Stopwatch watch;
  check_paths({a.high}, {a.json});
  if (!a.json.empty() && a.json != "-") prepare_parent(a.json);
  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const Mesh mesh = load_mesh(a.high, &warnings);
  if (mesh.uvs.empty()) {
    throw Error(ErrorCode::usage,
                "'" + a.high +
                    "' has no UVs to rate. To rate matches, give both meshes: kiln measure HIGH "
                    "LOW. With HIGH alone, name a study: --study views, faces or size.");
  }
  const std::uint32_t size = a.size.value_or(512);
  if (!console.progress(0.5, "rating the layout")) return kExitCancelled;
  const LayoutRating r = rate_layout(device, mesh, size, size);
  warnings.insert(warnings.end(), r.warnings.begin(), r.warnings.end());
  console.progress(1, "done");
  print_warnings(console, warnings, {}, "--json");
  if (a.json != "-") {
    for (const std::string& line : lines_of(r, size)) console.line(line);
  }
  if (a.json.empty()) return 0;
  const Json rating = fields(
      "triangles degenerate flat mirrored area stretch_l2 stretch_linf uniformity_percent "
      "texels_per_unit charts seams seam_length texels used overlap",
      {r.triangles, r.degenerate, r.flat, r.mirrored, r.area, r.stretch_l2, r.stretch_linf,
       r.uniformity_percent,
       fields("least mean greatest", {r.least_density, r.mean_density, r.greatest_density}),
       r.charts, r.seams, r.seam_length, r.texels, r.used, r.overlap});
  const Json json =
      fields("version inputs options layout seconds memory warnings",
             {version(), fields("low", {describe(mesh, a.high)}), fields("size", {size}), rating,
              fields("rate total", {r.seconds, watch.total()}),
              fields("peak_resident_bytes", {peak_resident_bytes()}), describe(warnings)});
  save_report(a.json, json);
  return 0;
}

// ---- studies -----------------------------------------------------------------------------------

/// Contradictions between several options.
void check_study(const MeasureArguments& a) {
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

int run_one_study(const MeasureArguments& a) {
  check_study(a);
  const StudyOptions options = study_options(a);
  Console console(a.quiet, a.json);
  Stopwatch watch;
  const fs::path folder = a.out;
  prepare_output_folder(folder);
  prepare_parent(a.json);

  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const Mesh high = load_dense(a.high, a.heights, warnings).mesh;
  std::optional<Mesh> low;
  if (!a.low.empty()) {
    low = load_light(a.low, ", or leave LOW out", warnings);
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

  if (!a.json.empty()) {
    double bake = 0, measure = 0;
    for (const Setting& setting : study.settings) {
      bake += setting.seconds_bake;
      measure += setting.seconds_measure;
    }
    // Options in force; null: varied by the study, or not used.
    const bool views = options.kind == StudyKind::views;
    Json json =
        fields("version device inputs options",
               {version(), describe(device.info()),
                fields("high low", {describe(high, a.high), low ? describe(*low, a.low) : Json()}),
                fields("study max_distance views view_size size faces height extent z_up",
                       {a.study, a.max_distance, views ? Json() : Json(options.views),
                        options.view_size == 0 ? Json("auto") : Json(options.view_size),
                        options.kind == StudyKind::size ? Json() : Json(options.size),
                        views && a.low.empty() ? Json(options.faces) : Json(),
                        is_height_field(a.high) ? Json(a.heights.height) : Json(),
                        a.heights.extent.empty() ? Json() : Json(a.heights.extent), a.view.z_up})});
    json.update(describe(study, options));
    add_ending(json,
               fields("load low bake measure study save", {seconds_load, study.seconds_low, bake,
                                                           measure, seconds_study, seconds_save}),
               watch, outputs, warnings);
    save_text(a.json, to_text(json));
  }
  console.progress(1, "done");
  std::vector<Warning> of_settings;
  for (const Setting& setting : study.settings) {
    of_settings.insert(of_settings.end(), setting.warnings.begin(), setting.warnings.end());
  }
  print_warnings(console, warnings, of_settings, "--json");
  for (const std::string& line : study_lines(study, options)) console.line(line);
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

// ---- two meshes --------------------------------------------------------------------------------

/// The flags of the match for one method, as the bake has them.
BakeArguments baking(const MeasureArguments& a, const std::string& method) {
  BakeArguments bake = a.bake;
  bake.high = a.high;
  bake.low = a.low;
  bake.heights = a.heights;
  bake.match = method;
  if (a.views) bake.views = std::to_string(*a.views);
  if (a.view_size) bake.view_size = *a.view_size;
  return bake;
}

/// Maps whose errors are asked for.
std::vector<std::string> measured_maps(const MeasureArguments& a) {
  const bool asked = a.bake.given.contains("--maps") || a.bake.given.contains("--transfer");
  std::vector<std::string> maps = asked ? all_maps(a.bake) : std::vector<std::string>();
  for (auto map = maps.begin(); map != maps.end();) {
    map = std::find(maps.begin(), map, *map) == map ? map + 1 : maps.erase(map);
  }
  return maps;
}

/// Bakes as the flags say; methods that a flag does not serve are left out, or refused where they were named.
/// \param textures  of HIGH, that maps hold; it and the inputs outlive the rating
void take_match_flags(const MeasureArguments& a, const DenseInput& dense, const MatchInputs& inputs,
                      const BakeOptions& textures, RatingOptions& options,
                      std::vector<LeftOut>& unserved) {
  std::erase_if(options.methods, [&](const std::string& method) {
    try {
      check(baking(a, method));
    } catch (const Error& error) {
      if (options.strict || !a.bake.load_match.empty()) throw;
      unserved.push_back({method, error.what()});
      return true;
    }
    return false;
  });
  if (options.methods.empty()) throw Error(ErrorCode::usage, unserved.front().reason);
  options.bake_of = [&, own = options.max_distance](const std::string& method) {
    const BakeArguments bake = baking(a, method);
    BakeOptions result = bake_options(bake);
    result.width = result.height = options.size;
    result.color = textures.color;
    result.opacity = textures.opacity;
    result.transfers = textures.transfers;
    const bool cage = !bake.cage.empty() || !bake.cage_mesh.empty();
    if (!cage || a.distance_given) result.max_distance = own;
    result.uv = uv_options(dense, result.uv);
    inputs.apply(result);
    return result;
  };
}

/// Without --study: every way to match asked for, rated on the two meshes.
int run_rating(const MeasureArguments& a) {
  if (a.low.empty()) {
    fail(
        "To rate matches, give both meshes: kiln measure HIGH LOW. With HIGH alone, name a study: "
        "--study views, faces or size. Of one mesh without other flags than --size, the UVs are "
        "rated.");
  }
  if (a.faces) fail("--faces is for --study: leave it out.");
  const bool loaded = !a.bake.load_match.empty();
  if (loaded && !a.matches.empty()) {
    fail("--load-match is a match that was made: leave --match out.");
  }
  RatingOptions options;
  options.methods = loaded              ? std::vector<std::string>{default_match()}
                    : a.matches.empty() ? match_names()
                                        : a.matches;
  for (const std::string& at : a.visibility_at) {
    options.visibility_at.push_back(visibility_at_values().at(at));
  }
  if (!a.visibility_at.empty() &&
      std::none_of(options.methods.begin(), options.methods.end(),
                   [](const std::string& name) { return find_match(name).takes_visibility; })) {
    fail("--visibility-at is for --match visibility and hybrid: add one of them, or leave it out.");
  }
  options.strict = !a.matches.empty();
  options.maps = measured_maps(a);
  options.size = a.size.value_or(options.size);
  options.directions = a.directions.value_or(options.directions);
  options.pixels = a.pixels.value_or(options.pixels);
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  options.pictures = !a.out.empty();
  if (!options.pictures && a.asks_for_view()) {
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
  std::vector<std::string> inputs_read = high_files(baking(a, default_match()));
  for (const std::string& file : low_files(baking(a, default_match()))) inputs_read.push_back(file);
  inputs_read.insert(inputs_read.end(), {a.bake.load_match, a.bake.cage_mesh, a.bake.match_list});
  for (const std::string& file : occluder_files(a.bake)) inputs_read.push_back(file);
  for (const TransferArgument& transfer : parse_transfers(a.bake)) {
    inputs_read.push_back(transfer.file);
  }
  check_paths({inputs_read.begin(), inputs_read.end()}, files);
  if (options.pictures) prepare_output_folder(folder);
  prepare_parent(a.json);

  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const bool more = has_more_files(a.bake);
  const DenseInput dense = load_dense(high_files(baking(a, default_match())), a.heights,
                                      load_options(a.bake), more, warnings);
  const Mesh& high = dense.mesh;
  options.uv = uv_options(dense);
  const Mesh low = load_low(baking(a, default_match()), warnings);
  warn_of_boxes("HIGH and LOW", dense.mesh, low, warnings);
  check_has_uvs(low, a.low, "");
  MatchInputs inputs;
  inputs.read(a.bake, high, low, warnings);
  inputs.make_cage(baking(a, default_match()), device, high, low, warnings);
  std::vector<LeftOut> unserved;
  BakeOptions textures;
  if (!a.bake.given.empty() || a.views || a.view_size) {
    textures = bake_options(baking(a, default_match()));
    if (!options.maps.empty()) load_textures(a.bake, high, textures, warnings);
    take_match_flags(a, dense, inputs, textures, options, unserved);
  }
  const double seconds_load = watch.lap();
  std::optional<Ratings> ratings =
      rate(device, high, low, options, [&](double done, std::string_view stage) {
        return console.progress(0.05 + 0.9 * done, stage);
      });
  if (!ratings) return kExitCancelled;
  warnings.insert(warnings.end(), ratings->warnings.begin(), ratings->warnings.end());
  ratings->left_out.insert(ratings->left_out.end(), unserved.begin(), unserved.end());
  if (loaded) ratings->rows[0].name = ratings->rows[0].method = "loaded";
  const double seconds_rate = watch.lap();
  std::vector<std::string> outputs;
  if (options.pictures) {
    if (!console.progress(0.95, "writing")) return kExitCancelled;
    for (const Rating& row : ratings->rows) {
      const std::string stem = low.name + "_" + row.name;
      const AssessmentFields& f = row.match.fields;
      for (const auto& [measure, image] :
           {std::pair("object_space", &f.object_space), std::pair("image_space", &f.image_space),
            std::pair("normalised_image_space", &f.normalised_image_space),
            std::pair("uniformity", &f.uniformity), std::pair("match_distance", &f.match_distance),
            std::pair("stretch", &f.stretch), std::pair("normal_error", &row.normal_error)}) {
        outputs.push_back((folder / (stem + "_" + measure + ".exr")).string());
        save_image(*image, outputs.back(), {ImageFormat::exr_float});
      }
      if (row.recalled.empty()) continue;
      outputs.push_back((folder / (stem + "_recall.obj")).string());
      save_obj(recall_mesh(high, row), outputs.back());
    }
    if (!save_plots(folder, {ratings_plot(*ratings)}, outputs, warnings)) return kExitCancelled;
  }
  if (!a.json.empty()) {
    const bool field = is_height_field(a.high);
    Json json = fields(
        "version device inputs options",
        {version(), describe(device.info()),
         fields("high low", {describe(high, a.high), describe(low, a.low)}),
         fields("match visibility_at size directions pixels match_flags max_distance height extent "
                "view zoom z_up",
                {options.methods, a.visibility_at, options.size, options.directions, options.pixels,
                 a.bake.given, a.max_distance, field ? Json(a.heights.height) : Json(),
                 a.heights.extent.empty() ? Json() : Json(a.heights.extent),
                 Json::array({options.view.azimuth_degrees, options.view.elevation_degrees}),
                 options.view.zoom, options.view.z_up})});
    if (!options.maps.empty()) json["options"]["maps"] = options.maps;
    json.update(describe(*ratings));
    add_ending(json, {{"load", seconds_load}, {"rate", seconds_rate}}, watch, outputs, warnings);
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

Run add_measure(Command& app) {
  Command* command = name_lab_command(app, "measure");
  auto a = std::make_shared<MeasureArguments>();
  const std::set<std::string> own = {"--match",         "--max-distance", "--views", "--view-size",
                                     "--visibility-at", "--directions",   "--view"};
  a->matching_flags = add_matching_flags(*command, a->bake, own);
  a->matching_flags.merge(add_measured_map_flags(*command, a->bake));
  std::vector<std::string> names;
  for (const auto& [name, kind] : study_kinds()) names.push_back(name);
  command->add_option("HIGH", a->high, std::string("The high poly (") + kDenseKinds + ")")
      ->required();
  command->add_option(
      "LOW", a->low,
      "The low poly, with UVs; with --study views it may be left out: Kiln makes one");
  command
      ->add_option("--match", a->matches,
                   "A match to rate, as of kiln bake; may be given again (default: all, but uv "
                   "only where HIGH has UVs that lie over LOW's)")
      ->allow_extra_args(false)
      ->check(one_of(match_names()));
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
      ->check(range(12U, 4096U));
  command
      ->add_option("--pixels", a->pixels,
                   "Pixels a side of the pictures that rendered normals are measured in (default "
                   "512)")
      ->check(range(16U, 4096U));
  command
      ->add_option("--study", a->study,
                   "What varies: the views matched from, the low poly's faces, or its faces and "
                   "the map's size")
      ->check(one_of(names));
  command->add_option("--out", a->out,
                      "Folder for measure.png and the measures as textures (EXR); with --study for "
                      "study_<what>.csv and .png and study_<what>_error.png; and for what the "
                      "pictures show, ..._plot.json and .png");
  command->add_option("--views", a->views, "Depth views, where they do not vary (default 12)")
      ->check(range(1U, 128U));
  command
      ->add_option("--view-size", a->view_size,
                   "Pixels a side of a depth view (default: by the density of HIGH)")
      ->check(range(16U, 8192U));
  command
      ->add_option("--size", a->size,
                   "Texels a side (default 512; of a study, where they do not vary, 1024)")
      ->check(range(16U, 8192U));
  command
      ->add_option("--faces", a->faces,
                   "--study views without LOW: triangles of the low poly (default 2000)")
      ->check(range(4U, 100000000U));
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  add_height_options(*command, a->heights, "The height field (HIGH is a PNG or EXR)");
  command
      ->add_option("--picture-size", a->picture_size,
                   "Pixels of a picture's longer side (default: by how much of it the mesh fills)")
      ->check(range(64U, 4096U));
  add_view_options(*command, a->view);
  command->add_option("--device", a->device, "OpenCL device: index or part of its name");
  command->add_option("--json", a->json, "Write a report to this file");
  command->add_flag("--quiet", a->quiet,
                    "Leave out progress and the summary; warnings and errors stay");
  return [a, command] {
    for (const std::string& flag : given_flags(*command)) {
      const bool takes = a->matching_flags.contains(flag);
      if (takes) a->bake.given.insert(flag);
      if (flag == "--max-distance") a->distance_given = true;
      if (!takes || a->study.empty()) continue;
      throw Error(ErrorCode::usage, flag + " is for rating matches: leave out --study, or it.");
    }
    part_maps(a->bake);
    if (a->study.empty() && a->low.empty()) {
      const std::set<std::string> own_of_layouts = {"--size", "--json", "--quiet", "--device"};
      const std::set<std::string> given = given_flags(*command);
      if (std::all_of(given.begin(), given.end(),
                      [&](const std::string& flag) { return own_of_layouts.contains(flag); })) {
        return rate_one_layout(*a);
      }
    }
    return a->study.empty() ? run_rating(*a) : run_one_study(*a);
  };
}

}  // namespace kiln::cli
