#include "lab/chart.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "interrupt.h"
#include "job/files.h"
#include "kiln/files.h"
#include "lab/lab_run.h"

namespace kiln::cli {
namespace {

constexpr double kProgressAtSave =
    0.98;  // Share of the whole progress that is complete when saving starts

/// Finds the index in `values` of their median; for an even number of values, that of the lower of the two middle ones.
std::size_t find_median_index(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  return order[(order.size() - 1) / 2];
}

double error_of(const Mark& mark, const Measure& measure) {
  return measure.scale * mark.figures.at(measure.path).number();
}

bool is_on_front(const Mark& mark, const std::vector<Mark>& marks, const Measure& measure) {
  const double error = error_of(mark, measure);
  return std::none_of(marks.begin(), marks.end(), [&](const Mark& other) {
    const double other_error = error_of(other, measure);
    return other.seconds <= mark.seconds && other_error <= error &&
           (other.seconds < mark.seconds || other_error < error);
  });
}

/// Formats a group's tables and the lines after them as text, for chart.md and the terminal.
std::vector<std::string> format_group(const ChartGroup& group) {
  std::vector<std::string> lines;
  for (const ChartTable& table : group.tables) {
    if (table.columns.empty()) continue;
    if (!table.note.empty()) lines.insert(lines.end(), {table.note, ""});
    for (const std::string& line : table_lines(table.columns, table.rows)) lines.push_back(line);
    lines.emplace_back();
  }
  for (const std::string& line : group.lines) lines.insert(lines.end(), {line, ""});
  return lines;
}

/// Collects the rows of each data file, by the file's suffix. Each file contains the rows of all groups, with the
/// group's number under `key`.
std::map<std::string, Json> collect_data(const char* key, const std::vector<ChartGroup>& groups) {
  std::map<std::string, Json> files;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (const ChartTable& table : groups[i].tables) {
      if (table.data_suffix == nullptr) continue;
      for (const Json& row : table.rows.elements()) {
        Json row_with_number = {{key, i + 1}};
        row_with_number.update(row);
        files[table.data_suffix].push_back(std::move(row_with_number));
      }
    }
  }
  return files;
}

}  // namespace

bool time_in_turns(std::vector<Mark>& marks, std::uint32_t repeat,
                   const std::function<Json(std::size_t mark, const std::string& note)>& run) {
  for (std::uint32_t round = 1; round <= repeat; ++round) {
    const std::string note = ", run " + std::to_string(round) + " of " + std::to_string(repeat);
    for (std::size_t i = 0; i < marks.size(); ++i) {
      Json seconds = run(i, note);
      if (seconds.is_null()) return false;
      marks[i].runs.push_back(std::move(seconds));
    }
  }
  return true;
}

Json finish_marks(std::vector<Mark>& marks, const char* compared_path,
                  const std::vector<Measure>& measures) {
  for (Mark& mark : marks) {
    std::vector<double> totals;
    for (const Json& run : mark.runs) {
      mark.run_seconds.push_back(run.at(compared_path).number());
      totals.push_back(run.at("total").number());
    }
    const std::size_t median = find_median_index(mark.run_seconds);
    mark.seconds = mark.run_seconds[median];
    Json seconds = mark.runs[median];
    if (seconds.is_object()) seconds["total"] = totals[find_median_index(totals)];
    const auto [least, most] =
        std::minmax_element(mark.run_seconds.begin(), mark.run_seconds.end());
    mark.figures.update(fields("seconds seconds_least seconds_most runs",
                               {seconds, *least, *most, Json(mark.runs)}));
  }
  std::vector<const Mark*> sorted;
  Json settings = Json::array(), fronts = Json::object();
  for (Mark& mark : marks) {
    for (const Measure& measure : measures) {
      mark.figures["on_front"][measure.name] = is_on_front(mark, marks, measure);
    }
    sorted.push_back(&mark);
    settings.push_back(mark.figures);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Mark* a, const Mark* b) { return a->seconds < b->seconds; });
  for (const Measure& measure : measures) {
    Json& names = fronts[measure.name] = Json::array();
    for (const Mark* mark : sorted) {
      if (is_on_front(*mark, marks, measure)) names.push_back(mark->name);
    }
  }
  return {{"settings", settings}, {"front", fronts}};
}

Json chart_panel(const std::vector<Mark>& marks, const Measure& measure) {
  Json shown = Json::array();
  for (const Mark& mark : marks) {
    shown.push_back(fields("label family seconds error front runs",
                           {mark.label, mark.family, mark.seconds, error_of(mark, measure),
                            is_on_front(mark, marks, measure), mark.run_seconds}));
  }
  return fields("name title unit marks", {measure.name, measure.title, measure.unit, shown});
}

bool ChartKind::check_inputs(const Progress&) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    // If a file cannot be read, read() throws the error that explains why.
    if (!is_readable_file(inputs[i])) read(i);
  }
  return true;
}

Json ChartKind::plot(const DeviceInfo& device, const std::vector<ChartGroup>& groups) const {
  std::set<std::string> families;
  Json shown = Json::array(), used_styles = Json::array();
  for (const ChartGroup& group : groups) {
    shown.push_back(fields("title note panels", {group.title, group.note, group.panels}));
    for (const Json& panel : group.panels.elements()) {
      for (const Json& mark : panel.at("marks").elements()) {
        families.insert(mark.at("family").text());
      }
    }
  }
  for (const MarkStyle& style : styles) {
    if (!families.contains(style.family)) continue;
    used_styles.push_back(
        fields("family title mark color", {style.family, style.title, style.mark, style.color}));
  }
  const std::string runs = a_.repeat == 1 ? ", one run"
                                          : ", median of " + std::to_string(a_.repeat) +
                                                " runs (thin lines: fastest to slowest)";
  return fields("kind title subtitle seconds_title styles groups",
                {"chart", title, subtitle + device.name + runs, seconds_title, used_styles, shown});
}

bool ChartArguments::selects(const std::string& setting) const {
  return std::find(settings.begin(), settings.end(), setting) != settings.end();
}

HighPolyInput read_high(const ChartArguments& a, const std::string& path,
                        std::vector<Warning>& warnings) {
  HighPolyInput high = load_high(path, is_height_field(path) ? a.heights : HeightFieldOptions(),
                                 warnings, load_options(a, MeshSide::high));
  shade(a.frame.shading, high, warnings);
  return high;
}

int run_chart(const ChartArguments& a, Json options, ChartKind& kind) {
  LabRun run(a);
  const std::filesystem::path folder = a.out;
  const Device device = Device::open(a.device);
  const DeviceInfo info = device.info();
  if (!kind.check_inputs(run.partial_progress(0, 0))) return kExitCancelled;
  double seconds_load = run.watch.lap(), seconds_chart = 0;
  std::vector<ChartGroup> groups;
  Json measured = Json::array();
  const double step = kProgressAtSave / static_cast<double>(kind.inputs.size());
  for (std::size_t i = 0; i < kind.inputs.size(); ++i) {
    const double start = step * static_cast<double>(i);
    const Progress show = run.partial_progress(start, start + step);
    if (!show(0, "reading " + kind.inputs[i])) return kExitCancelled;
    kind.read(i);
    seconds_load += run.watch.lap();
    std::optional<ChartGroup> group = kind.measure(device, i, show);
    if (!group) return kExitCancelled;
    measured.push_back(group->report);
    groups.push_back(std::move(*group));
    seconds_chart += run.watch.lap();
  }

  if (!run.console.progress(kProgressAtSave, "writing")) return kExitCancelled;
  run.warnings = std::move(kind.warnings);
  run.settings_warnings = std::move(kind.settings_warnings);
  const auto save = [&](const std::string& ending, const std::string& text) {
    run.outputs.push_back((folder / (kChartName + ending)).string());
    save_text(run.outputs.back(), text);
  };
  for (const auto& [ending, rows] : collect_data(kind.input_key, groups)) save(ending, csv(rows));
  std::string text = "# Kiln's chart\n\nOn " + markdown_text(info.name) + " (" +
                     markdown_text(info.platform) + ", driver " + markdown_text(info.driver) +
                     "). " + kind.explanation + "\n\n";
  for (const ChartGroup& group : groups) {
    const std::vector<std::string> lines = format_group(group);
    text += "## " + markdown_text(group.title) + "\n\n" + join(lines, "\n") + "\n";
    run.lines.push_back(group.title + ":");
    run.lines.insert(run.lines.end(), lines.begin(), lines.end());
  }
  save(".md", text);
  const Plot plot{kChartName, kind.plot(info, groups)};
  if (!save_plots(folder, {plot}, run.outputs, run.warnings)) return kExitCancelled;
  run.json = (folder / (std::string(kChartName) + ".json")).string();
  run.outputs.push_back(run.json);
  options.update(kind.options);
  run.report.update(fields("device compile_seconds options",
                           {describe(info), device.compile_seconds(), options}));
  run.report[kind.inputs_key] = measured;
  run.seconds = fields("load chart save", {seconds_load, seconds_chart, run.watch.lap()});
  return run.finish();
}

}  // namespace kiln::cli
