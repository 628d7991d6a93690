#include <algorithm>

#include "arguments/parse.h"
#include "arguments/paths.h"
#include "arguments/small_file.h"
#include "interrupt.h"
#include "lab/chart_run.h"
#include "lab/chart_volume.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

VolumeChartOptions volume_options(const ChartArguments& a) {
  VolumeChartOptions options;
  options.extract = extract_options(a.surface);
  options.size = a.options.size;
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  options.repeat = a.options.repeat;
  options.pixels = a.options.pixels;
  if (a.settings.empty()) return options;
  std::erase_if(options.ways, [&](const VolumeWay& way) {
    return std::find(a.settings.begin(), a.settings.end(), way.name) == a.settings.end();
  });
  return options;
}

}  // namespace

int run_volumes_command(const ChartArguments& a) {
  const VolumeChartOptions options = volume_options(a);
  Console console(a.quiet);
  Stopwatch watch;
  const std::filesystem::path folder = a.out;
  prepare_output_folder(folder);
  const Device device = Device::open(a.device);
  for (const std::string& path : a.meshes) {
    std::vector<Warning> none;
    if (!is_readable_file(path)) read_volume(path, a.surface, none);  // says what is wrong with it
  }
  std::vector<Warning> warnings;
  std::vector<VolumeChart> charts;
  Json charts_json = Json::array();
  double seconds_load = watch.lap();
  double seconds_chart = 0;
  for (std::size_t i = 0; i < a.meshes.size(); ++i) {
    const std::string& path = a.meshes[i];
    const auto show = [&](double done, std::string_view stage) {
      return console.progress(
          kChartAtSave * (static_cast<double>(i) + done) / static_cast<double>(a.meshes.size()),
          stage);
    };
    if (!show(0, "reading " + path)) return kExitCancelled;
    const Volume volume = read_volume(path, a.surface, warnings);
    seconds_load += watch.lap();
    std::optional<VolumeChart> chart = run_volume_chart(device, volume, options, show);
    if (!chart) return kExitCancelled;
    warnings.insert(warnings.end(), chart->warnings.begin(), chart->warnings.end());
    Json json = {{"volume", cli::describe(volume, path)}};
    json.update(cli::describe(*chart));
    charts_json.push_back(std::move(json));
    charts.push_back(std::move(*chart));
    seconds_chart += watch.lap();
  }

  if (!console.progress(kChartAtSave, "writing")) return kExitCancelled;
  const ChartFiles files = save_chart_files(folder, volume_chart_data(charts),
                                            volume_chart_plot(charts, options, device.info()),
                                            volume_chart_table(charts, options, device.info()));
  if (files.cancelled) return kExitCancelled;
  warnings.insert(warnings.end(), files.warnings.begin(), files.warnings.end());
  const std::filesystem::path report = files.outputs.back();
  Json option_json = cli::describe(a.surface, options.extract);
  Json names = Json::array();
  for (const VolumeWay& way : options.ways) names.push_back(way.name);
  option_json.update({{"size", options.size},
                      {"chart_border", options.extract.border_texels},
                      {"max_distance", a.max_distance},
                      {"repeat", options.repeat},
                      {"pixels", options.pixels},
                      {"settings", names}});
  Json json = {{"version", version()},
               {"device", cli::describe(device.info())},
               {"compile_seconds", device.compile_seconds()},
               {"options", option_json},
               {"volumes", charts_json}};
  add_ending(json, {{"load", seconds_load}, {"chart", seconds_chart}, {"save", watch.lap()}}, watch,
             files.outputs, warnings);
  save_report(report, json);

  console.progress(1, "done");
  std::vector<Warning> of_ways;
  for (const VolumeChart& chart : charts) {
    for (const VolumeRow& row : chart.rows) {
      if (!row.report) continue;
      of_ways.insert(of_ways.end(), row.report->warnings.begin(), row.report->warnings.end());
    }
  }
  print_warnings(console, warnings, of_ways, report.string());
  for (const VolumeChart& chart : charts) {
    console.line(chart.name + ", " + with_commas(chart.dense_triangles) + " faces, to " +
                 with_commas(chart.light.faces) + " (* nothing else is both faster and closer):");
    for (const VolumeRow& row : chart.rows) console.line(summary(row));
  }
  for (const std::string& output : files.outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace kiln::cli
