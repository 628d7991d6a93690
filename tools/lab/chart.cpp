#include "lab/chart.h"

#include <algorithm>
#include <numeric>

#include "arguments/files.h"
#include "interrupt.h"
#include "kiln/files.h"
#include "lab/table.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

constexpr double kAtSave = 0.98;  // of the progress

std::vector<bool> pareto_front(const std::vector<Mark*>& marks, std::size_t measure) {
  std::vector<bool> front;
  for (const Mark* p : marks) {
    const double error = p->errors[measure];
    front.push_back(std::none_of(marks.begin(), marks.end(), [&](const Mark* q) {
      return q->seconds <= p->seconds && q->errors[measure] <= error &&
             (q->seconds < p->seconds || q->errors[measure] < error);
    }));
  }
  return front;
}

}  // namespace

double Mark::least() const { return *std::min_element(runs.begin(), runs.end()); }
double Mark::most() const { return *std::max_element(runs.begin(), runs.end()); }

std::size_t median_index(const std::vector<double>& keys) {
  std::vector<std::size_t> order(keys.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
  return order[(order.size() - 1) / 2];
}

void mark_fronts(const std::vector<Mark*>& marks) {
  for (std::size_t m = 0; m < marks.front()->errors.size(); ++m) {
    const std::vector<bool> front = pareto_front(marks, m);
    for (std::size_t i = 0; i < marks.size(); ++i) marks[i]->front.push_back(front[i]);
  }
}

std::string front_dot(const Mark& mark, std::size_t measure) {
  return mark.front[measure] ? "●" : "";
}

Json describe_front(const Mark& mark, std::span<const Measure> measures) {
  Json json;
  for (std::size_t m = 0; m < measures.size(); ++m) json[measures[m].name] = bool{mark.front[m]};
  return json;
}

Json front_names(const std::vector<const Mark*>& marks, std::size_t measure) {
  Json names = Json::array();
  for (const Mark* mark : marks) {
    if (mark->front[measure]) names.push_back(mark->name);
  }
  return names;
}

Json chart_panel(const std::vector<const Mark*>& marks, std::span<const Measure> measures,
                 std::size_t measure) {
  const Measure& m = measures[measure];
  Json panel = fields("name title unit marks", {m.name, m.title, m.unit, Json::array()});
  for (const Mark* mark : marks) {
    panel["marks"].push_back(
        fields("label family seconds error front runs",
               {mark->label, mark->family, mark->seconds, mark->errors[measure],
                bool{mark->front[measure]}, mark->runs}));
  }
  return panel;
}

void add_styles(std::span<const MarkStyle> styles, const std::vector<const Mark*>& marks,
                Json& plot) {
  for (const MarkStyle& style : styles) {
    if (std::none_of(marks.begin(), marks.end(),
                     [&](const Mark* mark) { return mark->family == style.family; })) {
      continue;
    }
    plot["styles"].push_back(
        fields("family title mark color", {style.family, style.title, style.mark, style.color}));
  }
}

std::string runs_note(unsigned repeat) {
  return repeat == 1
             ? ", one run"
             : ", median of " + std::to_string(repeat) + " runs (thin lines: fastest to slowest)";
}

std::string runs_text(unsigned repeat) {
  return repeat == 1 ? "one run" : "the median of " + std::to_string(repeat) + " runs";
}

std::string on_device(const DeviceInfo& device) {
  return "On " + markdown_cell(device.name) + " (" + markdown_cell(device.platform) + ", driver " +
         markdown_cell(device.driver) + ")";
}

bool ChartArguments::names(const std::string& setting) const {
  return std::find(settings.begin(), settings.end(), setting) != settings.end();
}

bool has_height_fields(const ChartArguments& a) {
  for (std::size_t i = 0; i < a.meshes.size(); i += 2) {
    if (is_height_field(a.meshes[i])) return true;
  }
  return false;
}

int run_chart(const ChartArguments& a, ChartKind& kind) {
  Console console(a.quiet);
  Stopwatch watch;
  const std::filesystem::path folder = a.out;
  prepare_output_folder(folder);
  const Device device = Device::open(a.device);
  if (!kind.look([&](double, std::string_view stage) { return console.progress(0, stage); })) {
    return kExitCancelled;
  }
  double seconds_load = watch.lap(), seconds_chart = 0;
  Json measured = Json::array();
  for (std::size_t i = 0; i < kind.inputs.size(); ++i) {
    const auto show = [&](double done, std::string_view stage) {
      const double before = static_cast<double>(i), count = static_cast<double>(kind.inputs.size());
      return console.progress(kAtSave * (before + done) / count, stage);
    };
    if (!show(0, "reading " + kind.inputs[i])) return kExitCancelled;
    kind.read(i);
    seconds_load += watch.lap();
    std::optional<Json> json = kind.measure(device, i, show);
    if (!json) return kExitCancelled;
    measured.push_back(std::move(*json));
    seconds_chart += watch.lap();
  }

  if (!console.progress(kAtSave, "writing")) return kExitCancelled;
  std::vector<std::string> outputs;
  const auto save = [&](const char* ending, const std::string& text) {
    outputs.push_back((folder / (std::string(kChartName) + ending)).string());
    save_text(outputs.back(), text);
  };
  save(".csv", kind.data());
  save(".md", kind.table(device.info()));
  if (const std::string text = kind.ao_data(); !text.empty()) save("_ao.csv", text);
  const Plot plot{kChartName, kind.plot(device.info()), std::nullopt};
  if (!save_plots(folder, {plot}, outputs, kind.warnings)) return kExitCancelled;
  outputs.push_back((folder / (std::string(kChartName) + ".json")).string());
  Json report =
      fields("version device compile_seconds options",
             {version(), describe(device.info()), device.compile_seconds(), kind.options()});
  report[kind.inputs_key] = measured;
  add_ending(report, fields("load chart save", {seconds_load, seconds_chart, watch.lap()}), watch,
             outputs, kind.warnings);
  save_report(outputs.back(), report);

  console.progress(1, "done");
  print_warnings(console, kind.warnings, kind.of_settings, outputs.back());
  for (const std::string& line : kind.lines()) console.line(line);
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace kiln::cli
