#include <algorithm>
#include <memory>

#include "arguments/dense_input.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "arguments/small_file.h"
#include "arguments/surface_arguments.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "lab/chart_output.h"
#include "lab/chart_run.h"
#include "lab/chart_volume.h"
#include "picture/plot.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

std::string file_name(const char* ending) { return std::string(kChartName) + ending; }

ChartOptions chart_options(const ChartArguments& a) {
  ChartOptions options = a.options;
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  options.directions = a.directions.value_or(options.directions);
  if (a.settings.empty()) return options;
  options.strict = true;
  options.settings = all_chart_settings();
  std::erase_if(options.settings, [&](const ChartSetting& setting) {
    const bool named =
        std::find(a.settings.begin(), a.settings.end(), setting.name) != a.settings.end();
    return !named && setting.name != kChartReference;
  });
  return options;
}

Json json_of(const ChartArguments& a, const ChartOptions& options) {
  Json names = Json::array();
  for (const ChartSetting& setting : options.settings) names.push_back(setting.name);
  Json ao_names = Json::array();
  for (const AoSetting& setting : ao_options(a).settings) ao_names.push_back(setting.name);
  return {{"size", options.size},
          {"max_distance", a.max_distance},
          {"height", has_height_fields(a) ? Json(a.heights.height) : Json()},
          {"extent", a.heights.extent.empty() ? Json() : Json(a.heights.extent)},
          {"repeat", options.repeat},
          {"directions", options.directions},
          {"pixels", options.pixels},
          {"settings", names},
          {"ao_settings", ao_names}};
}

}  // namespace

ChartFiles save_chart_files(const fs::path& folder, const std::string& data, const Plot& plot,
                            const std::string& table, const std::string& ao_data) {
  ChartFiles files;
  const auto save = [&](const char* ending, const std::string& text) {
    save_text(folder / file_name(ending), text);
    files.outputs.push_back((folder / file_name(ending)).string());
  };
  save(".csv", data);
  save(".md", table);
  if (!ao_data.empty()) save("_ao.csv", ao_data);
  files.cancelled = !save_plots(folder, {plot}, files.outputs, files.warnings);
  files.outputs.push_back((folder / file_name(".json")).string());
  return files;
}

namespace {

int run_chart_command(const ChartArguments& arguments) {
  const ChartOptions options = chart_options(arguments);
  AoChartOptions ao = ao_options(arguments);
  ao.max_distance = options.max_distance;
  Console console(arguments.quiet);
  Stopwatch watch;
  const fs::path folder = arguments.out;
  prepare_output_folder(folder);
  const Device device = Device::open(arguments.device);

  // What could stop a long run later stops it now: low polys are read first, and dense ones looked for.
  std::vector<Warning> warnings;
  std::vector<Mesh> lows;
  const std::size_t count = arguments.meshes.size() / 2;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string& high = arguments.meshes[2 * i];
    if (!is_readable_file(high)) load_dense(high, {}, warnings);  // says what is wrong with it
    const std::string& low = arguments.meshes[2 * i + 1];
    if (!console.progress(0, "reading " + low)) return kExitCancelled;
    lows.push_back(load_light(low, "", warnings));
  }
  double seconds_load = watch.lap();
  double seconds_chart = 0;

  std::vector<ChartPair> pairs;
  Json pairs_json = Json::array();
  for (std::size_t i = 0; i < count; ++i) {
    const std::string& path = arguments.meshes[2 * i];
    const auto show = [&](double done, std::string_view stage) {
      const double before = static_cast<double>(i);
      return console.progress(kChartAtSave * (before + done) / static_cast<double>(count), stage);
    };
    if (!show(0, "reading " + path)) return kExitCancelled;
    const DenseInput dense =
        load_dense(path, is_height_field(path) ? arguments.heights : HeightArguments(), warnings);
    const Mesh& high = dense.mesh;
    seconds_load += watch.lap();
    ChartOptions own = options;
    own.uv = uv_options(dense);
    const double share = ao.settings.empty() ? 1 : 0.5;
    const auto first = [&](double done, std::string_view stage) {
      return show(share * done, stage);
    };
    const auto second = [&](double done, std::string_view stage) {
      return show(share + (1 - share) * done, stage);
    };
    std::optional<ChartPair> pair = run_chart(device, high, lows[i], own, first);
    if (!pair) return kExitCancelled;
    warnings.insert(warnings.end(), pair->warnings.begin(), pair->warnings.end());
    Json json = {{"high", describe(high, path)},
                 {"low", describe(lows[i], arguments.meshes[2 * i + 1])}};
    json.update(describe(*pair));
    if (!add_ao(device, high, lows[i], ao, second, *pair, json)) return kExitCancelled;
    pairs_json.push_back(std::move(json));
    pairs.push_back(std::move(*pair));
    seconds_chart += watch.lap();
  }

  if (!console.progress(kChartAtSave, "writing")) return kExitCancelled;
  const ChartFiles files =
      save_chart_files(folder, chart_data(pairs), chart_plot(pairs, options, device.info()),
                       chart_table(pairs, options, ao, device.info()), chart_ao_data(pairs));
  if (files.cancelled) return kExitCancelled;
  const std::vector<std::string>& outputs = files.outputs;
  warnings.insert(warnings.end(), files.warnings.begin(), files.warnings.end());
  const fs::path report = outputs.back();
  Json json = {{"version", version()},
               {"device", describe(device.info())},
               {"compile_seconds", device.compile_seconds()},
               {"options", json_of(arguments, options)},
               {"pairs", pairs_json}};
  add_ending(json, {{"load", seconds_load}, {"chart", seconds_chart}, {"save", watch.lap()}}, watch,
             outputs, warnings);
  save_report(report, json);

  console.progress(1, "done");
  std::vector<Warning> of_settings;
  for (const ChartPair& pair : pairs) {
    for (const ChartRow& row : pair.rows) {
      of_settings.insert(of_settings.end(), row.report.warnings.begin(), row.report.warnings.end());
    }
  }
  print_warnings(console, warnings, of_settings, report.string());
  for (const ChartPair& pair : pairs) {
    console.line(pair.high_name + " to " + pair.low_name +
                 " (* nothing else is both faster and closer):");
    for (const ChartRow& row : pair.rows) console.line(summary(row));
    if (!pair.ao) continue;
    for (const std::string& line : summary(*pair.ao, ao)) console.line(line);
  }
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

int run_chart(const ChartArguments& a) {
  check_chart(a);
  if (a.plan) return run_plan_command(a);
  return has_volumes(a) ? run_volumes_command(a) : run_chart_command(a);
}

}  // namespace

Run add_chart(Command& app) {
  Command* command = name_lab_command(app, "chart");
  auto a = std::make_shared<ChartArguments>();
  command
      ->add_option("HIGH", a->meshes,
                   "High polys (PLY, OBJ, STL, OFF) or height fields (PNG, EXR), each with its "
                   "light one, with UVs: a row of "
                   "panels a pair. Or volumes with --iso, a row of panels each. Or high polys "
                   "alone with --plan")
      ->type_name("LOW [HIGH2 LOW2 ...]")
      ->required();
  command
      ->add_option(
          "--out", a->out,
          "Folder for chart.json, .csv, .md and .png, and chart_plot.json, what the picture "
          "shows")
      ->required();
  command
      ->add_option("--size", a->options.size,
                   "Texels a side of the maps (of volumes half and twice that, too)")
      ->check(range(16U, 8192U))
      ->capture_default_str();
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  command
      ->add_option("--repeat", a->options.repeat,
                   "Timed runs of each setting, of which the median counts; one more comes first, "
                   "which compiles the kernels and gives the errors")
      ->check(range(1U, 1000U))
      ->capture_default_str();
  command
      ->add_option("--directions", a->directions,
                   "Of meshes: directions that viewing rays of object space, image space and "
                   "uniformity come from (default 512)")
      ->check(range(12U, 4096U));
  command
      ->add_option("--pixels", a->options.pixels,
                   "Pixels a side of the pictures that rendered normals are measured in")
      ->check(range(16U, 4096U))
      ->capture_default_str();
  command->add_flag("--ao", a->ao,
                    "Also ambient occlusion: 8 to 1024 rays, plain and smoothed, and 64 to 512 "
                    "views, against 4096 rays; takes minutes at 1024 texels a side");
  command
      ->add_option("--ao-error", a->ao_error,
                   "Of ambient occlusion: say what reaches this root mean square error in the "
                   "fewest seconds; a share of 1, such as 2/255 or 0.01")
      ->check(share_of_1());
  command
      ->add_option("--ao-budget", a->ao_budget,
                   "Of ambient occlusion: say what comes nearest to the truth in so many seconds")
      ->check(positive_number());
  add_plan_options(*command, *a);
  std::vector<std::string> names = mesh_setting_names();
  names.emplace_back(kHard);
  for (const VolumeWay& way : volume_ways()) {
    if (std::find(names.begin(), names.end(), way.name) == names.end()) names.push_back(way.name);
  }
  command
      ->add_option("--settings", a->settings,
                   "Some of the settings, by their names in chart.csv, separated by commas; "
                   "for meshes the "
                   "reference, " +
                       std::string(kChartReference) +
                       ", always comes along. hard: directions and cages, for hard surfaces "
                       "(default: all but those)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(one_of(names));
  command->add_option("--device", a->device, "OpenCL device: index or part of its name");
  command->add_flag("--quiet", a->quiet,
                    "Leave out progress and the summary; warnings and errors stay");
  add_height_options(*command, a->heights, "The height fields (HIGH is a PNG or EXR)");
  const auto own = command->get_options();
  add_surface_options(*command, a->surface);
  add_chart_border_option(*command, a->surface);
  add_raw_options(*command, a->surface);
  std::vector<const Option*> for_volumes;
  for (const Option* option : command->get_options()) {
    if (std::find(own.begin(), own.end(), option) == own.end()) for_volumes.push_back(option);
  }
  const std::vector<const Option*> not_for_plans = options_not_for_plans(*command);
  return [a, for_volumes, not_for_plans] {
    const auto given = [](const std::vector<const Option*>& options,
                          std::vector<std::string>& flags) {
      for (const Option* option : options) {
        if (option->count() != 0) flags.push_back(option->get_name());
      }
    };
    given(for_volumes, a->for_volumes);
    given(not_for_plans, a->not_for_plans);
    expand_settings(*a);
    return run_chart(*a);
  };
}

}  // namespace kiln::cli
