#include <algorithm>
#include <fstream>
#include <memory>

#include "chart_output.h"
#include "check_result.h"
#include "commands.h"
#include "console.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "parse.h"
#include "paths.h"
#include "plot.h"
#include "report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

struct ChartArguments {
  std::vector<std::string> meshes;
  std::string out, device;
  std::string max_distance = "2%";
  std::vector<std::string> settings;
  ChartOptions options;
  bool quiet = false;
};

std::string file_name(const char* ending) { return std::string(kChartName) + ending; }

/// Before any work. \throws Error(usage)
void check(const ChartArguments& a) {
  if (a.meshes.size() % 2 != 0) {
    throw Error(ErrorCode::usage, "Meshes come in pairs, HIGH LOW, but '" + a.meshes.back() +
                                      "' has no LOW: give its light mesh, with UVs.");
  }
  std::vector<fs::path> outputs;
  for (const char* ending : {".json", ".csv", ".md", ".gp", ".png"}) {
    outputs.push_back(fs::path(a.out) / file_name(ending));
  }
  check_paths({a.meshes.begin(), a.meshes.end()}, outputs);
}

ChartOptions chart_options(const ChartArguments& a) {
  ChartOptions options = a.options;
  options.max_distance = parse_reach(a.max_distance);
  if (a.settings.empty()) return options;
  options.strict = true;
  std::erase_if(options.settings, [&](const ChartSetting& setting) {
    const bool named =
        std::find(a.settings.begin(), a.settings.end(), setting.name) != a.settings.end();
    return !named && setting.name != kChartReference;
  });
  return options;
}

Json describe(const ChartArguments& a, const ChartOptions& options) {
  Json names = Json::array();
  for (const ChartSetting& setting : options.settings) names.push_back(setting.name);
  return {{"size", options.size},
          {"max_distance", a.max_distance},
          {"repeat", options.repeat},
          {"settings", names}};
}

int run_chart_command(const ChartArguments& arguments) {
  check(arguments);
  const ChartOptions options = chart_options(arguments);
  Console console(arguments.quiet);
  Stopwatch watch;
  const fs::path folder = arguments.out;
  prepare_output_folder(folder);
  const Device device = Device::open(arguments.device);

  // What could stop a long run later stops it now: light meshes are read first, and dense ones looked for.
  std::vector<Warning> warnings;
  std::vector<Mesh> lows;
  const std::size_t count = arguments.meshes.size() / 2;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string& high = arguments.meshes[2 * i];
    if (!std::ifstream(high)) load_mesh(high);  // says what is wrong with it
    const std::string& low = arguments.meshes[2 * i + 1];
    if (!console.progress(0, "reading " + low)) return kExitCancelled;
    lows.push_back(load_light(low, "", warnings));
  }
  double seconds_load = watch.lap();
  double seconds_chart = 0;

  constexpr double kAtSave = 0.98;
  std::vector<ChartPair> pairs;
  Json pairs_json = Json::array();
  for (std::size_t i = 0; i < count; ++i) {
    const std::string& path = arguments.meshes[2 * i];
    const auto show = [&](double done, std::string_view stage) {
      const double before = static_cast<double>(i);
      return console.progress(kAtSave * (before + done) / static_cast<double>(count), stage);
    };
    if (!show(0, "reading " + path)) return kExitCancelled;
    const Mesh high = load_mesh(path, &warnings);
    seconds_load += watch.lap();
    std::optional<ChartPair> pair = run_chart(device, high, lows[i], options, show);
    if (!pair) return kExitCancelled;
    warnings.insert(warnings.end(), pair->warnings.begin(), pair->warnings.end());
    Json json = {{"high", cli::describe(high, path)},
                 {"low", cli::describe(lows[i], arguments.meshes[2 * i + 1])}};
    json.update(cli::describe(*pair));
    pairs_json.push_back(std::move(json));
    pairs.push_back(std::move(*pair));
    seconds_chart += watch.lap();
  }

  if (!console.progress(kAtSave, "writing")) return kExitCancelled;
  std::vector<std::string> outputs;
  const auto save = [&](const char* ending, const std::string& text) {
    save_text(folder / file_name(ending), text);
    outputs.push_back((folder / file_name(ending)).string());
  };
  save(".csv", chart_data(pairs));
  save(".gp", chart_script(pairs, options, device.info()));
  save(".md", chart_table(pairs, options, device.info()));
  const std::string no_plot = draw_plot(folder, kChartName);
  if (interrupted()) return kExitCancelled;
  if (no_plot.empty()) {
    outputs.push_back((folder / file_name(".png")).string());
  } else {
    warnings.push_back({"no-plot", no_plot, 1});
  }
  const fs::path report = folder / file_name(".json");
  outputs.push_back(report.string());
  const double seconds_save = watch.lap();
  const Json json = {{"version", version()},
                     {"device", cli::describe(device.info())},
                     {"compile_seconds", device.compile_seconds()},
                     {"options", describe(arguments, options)},
                     {"pairs", pairs_json},
                     {"seconds",
                      {{"load", seconds_load},
                       {"chart", seconds_chart},
                       {"save", seconds_save},
                       {"total", watch.total()}}},
                     {"memory", {{"peak_resident_bytes", peak_resident_bytes()}}},
                     {"outputs", outputs},
                     {"warnings", cli::describe(warnings)}};
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
  }
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace

Run add_chart(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "chart", "Speed against accuracy for every way to match: a plot, a table and the figures");
  auto a = std::make_shared<ChartArguments>();
  command
      ->add_option("HIGH", a->meshes,
                   "Dense meshes (PLY, OBJ, STL, OFF), each with its light one, with UVs: a row of "
                   "panels a pair")
      ->type_name("LOW [HIGH2 LOW2 ...]")
      ->required();
  command->add_option("--out", a->out, "Folder for chart.json, .csv, .md, .gp and .png")
      ->required();
  command->add_option("--size", a->options.size, "Texels a side of the maps")
      ->check(CLI::Range(16U, 8192U))
      ->capture_default_str();
  command
      ->add_option("--max-distance", a->max_distance,
                   "How far to look each way: world units, or P% of HIGH's diagonal")
      ->capture_default_str();
  command
      ->add_option("--repeat", a->options.repeat,
                   "Timed runs of each setting, of which the median counts; one more comes first, "
                   "which compiles the kernels and gives the errors")
      ->check(CLI::Range(1U, 1000U))
      ->capture_default_str();
  std::vector<std::string> names;
  for (const ChartSetting& setting : a->options.settings) names.push_back(setting.name);
  command
      ->add_option("--settings", a->settings,
                   "Some of the ways to match, by their names in chart.csv; the reference, " +
                       std::string(kChartReference) + ", always comes along (default: all)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(names));
  command->add_option("--device", a->device, "OpenCL device: index or part of its name");
  command->add_flag("--quiet", a->quiet, "Print nothing but errors");
  return [a] { return run_chart_command(*a); };
}

}  // namespace kiln::cli
