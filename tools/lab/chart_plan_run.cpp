// `kiln chart HIGH --plan`.
#include <algorithm>
#include <utility>

#include "arguments/map_bounds.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "arguments/small_file.h"
#include "interrupt.h"
#include "lab/chart_output.h"
#include "lab/chart_plan.h"
#include "lab/chart_run.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

/// Of a name, as maps are told apart elsewhere: "normal=1.5".
double plan_error(const std::string& text) {
  const std::string bound = normal_bound(text);
  return parse_degrees("--max-error", bound.empty() ? text : bound);
}

PlanChartOptions plan_options(const ChartArguments& a) {
  PlanChartOptions options;
  options.size = a.options.size;
  if (!a.screen.empty()) options.screen = parse_pixels("--screen", a.screen);
  for (const std::string& text : a.max_errors) options.errors.push_back(plan_error(text));
  return options;
}

}  // namespace

void add_plan_options(Command& command, ChartArguments& a) {
  command.add_flag("--plan", a.plan,
                   "Of each HIGH alone: bytes against error of low polys by number of faces and "
                   "map size. Beside them plans, and meshoptimizer with a plain bake");
  command
      .add_option("--max-error", a.max_errors,
                  "With --plan: errors to plan for, degrees, separated by commas (default: three "
                  "between the best and the worst)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_option("--screen", a.screen,
                     "With --plan: the largest size at which the mesh will be seen, such as 600px; "
                     "plans and the grid are measured at that size, by mean normals of pixels");
}

std::vector<const Option*> options_not_for_plans(const Command& command) {
  std::vector<const Option*> options;
  for (const char* name : {"--settings", "--repeat", "--max-distance", "--ao", "--ao-error",
                           "--ao-budget", "--directions", "--pixels"}) {
    options.push_back(command.find_option(name));
  }
  return options;
}

void check_plan(const ChartArguments& a) {
  if (!a.plan) {
    if (!a.screen.empty()) {
      throw Error(ErrorCode::usage, "--screen says at which size --plan looks: add --plan.");
    }
    if (a.max_errors.empty()) return;
    throw Error(ErrorCode::usage, "--max-error says what --plan plans for: add --plan.");
  }
  for (const std::string& flag : a.not_for_plans) {
    throw Error(ErrorCode::usage,
                flag + " is for charts of matches, but --plan charts bytes: leave it out.");
  }
  if (!a.for_volumes.empty()) {
    throw Error(ErrorCode::usage,
                a.for_volumes.front() + " is for volumes, but --plan takes meshes.");
  }
  for (const std::string& path : a.meshes) {
    if (is_volume_name(path)) {
      throw Error(ErrorCode::usage,
                  "'" + path + "' is a volume, but --plan takes high polys alone.");
    }
  }
  const bool fields = std::any_of(a.meshes.begin(), a.meshes.end(), is_height_field);
  if (!fields && a.heights.given()) {
    throw Error(ErrorCode::usage,
                "--height and --extent are for a HIGH that is a height field, a PNG or EXR; none "
                "is.");
  }
  height_field_options(a.heights);
  plan_options(a);
}

int run_plan_command(const ChartArguments& a) {
  const PlanChartOptions options = plan_options(a);
  Console console(a.quiet);
  Stopwatch watch;
  const std::filesystem::path folder = a.out;
  prepare_output_folder(folder);
  const Device device = Device::open(a.device);
  std::vector<Warning> warnings;
  for (const std::string& path : a.meshes) {
    if (!is_readable_file(path)) load_dense(path, {}, warnings);  // says what is wrong with it
  }
  std::vector<PlanChart> charts;
  Json charts_json = Json::array();
  double seconds_load = 0, seconds_chart = 0;
  for (std::size_t i = 0; i < a.meshes.size(); ++i) {
    const std::string& path = a.meshes[i];
    const auto show = [&](double done, std::string_view stage) {
      const double before = static_cast<double>(i);
      return console.progress(kChartAtSave * (before + done) / static_cast<double>(a.meshes.size()),
                              stage);
    };
    if (!show(0, "reading " + path)) return kExitCancelled;
    DenseInput dense =
        load_dense(path, is_height_field(path) ? a.heights : HeightArguments(), warnings);
    if (!dense.heights) turn_strays(dense.mesh, warnings);
    seconds_load += watch.lap();
    std::optional<PlanChart> chart = run_plan_chart(device, dense.mesh, options, show);
    if (!chart) return kExitCancelled;
    warnings.insert(warnings.end(), chart->warnings.begin(), chart->warnings.end());
    Json json = {{"high", cli::describe(dense.mesh, path)}};
    json.update(cli::describe(*chart));
    charts_json.push_back(std::move(json));
    charts.push_back(std::move(*chart));
    seconds_chart += watch.lap();
  }

  if (!console.progress(kChartAtSave, "writing")) return kExitCancelled;
  const ChartFiles files =
      save_chart_files(folder, plan_chart_data(charts), plan_chart_plot(charts),
                       plan_chart_table(charts, device.info()));
  if (files.cancelled) return kExitCancelled;
  warnings.insert(warnings.end(), files.warnings.begin(), files.warnings.end());
  Json json = {{"version", version()},
               {"device", cli::describe(device.info())},
               {"compile_seconds", device.compile_seconds()},
               {"options",
                {{"size", options.size},
                 {"max_error", options.errors},
                 {"screen", options.screen == 0 ? Json() : Json(options.screen)}}},
               {"meshes", charts_json}};
  add_ending(json, {{"load", seconds_load}, {"chart", seconds_chart}, {"save", watch.lap()}}, watch,
             files.outputs, warnings);
  save_report(files.outputs.back(), json);

  console.progress(1, "done");
  print_warnings(console, warnings, {}, files.outputs.back());
  for (const PlanChart& chart : charts) {
    console.line(chart.name + ", " + with_commas(chart.faces) + " faces, plans:");
    for (const std::string& line : summary(chart)) console.line(line);
  }
  for (const std::string& output : files.outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace kiln::cli
