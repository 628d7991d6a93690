#include "picture/plot.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "base/process.h"
#include "interrupt.h"
#include "kiln/error.h"
#include "kiln/files.h"

namespace kiln::cli {

extern const char kPlotScript[];  // the contents of picture/plot.py, embedded by CMakeLists.txt

namespace {

namespace fs = std::filesystem;

constexpr int kNoMatplotlib = 69;  // exit code of the script if matplotlib is missing
// limit in seconds; matplotlib lists all fonts in its first run
constexpr double kLimitSeconds = 300;
constexpr const char* kScriptName = "kiln_plot.py";

}  // namespace

Json plot_panel(const std::string& y_title) {
  return {{"y_title", y_title},
          {"curves", Json::array()},
          {"levels", Json::array()},
          {"rings", {{"title", ""}, {"x", Json::array()}, {"y", Json::array()}}}};
}

Json power_of_four_ticks(double least, double most) {
  Json tick_values = Json::array();
  double tick = 1.0 / 256;
  while (4 * tick <= least) tick *= 4;
  for (; tick_values.size() < 2 || tick_values.back().number() < most; tick *= 4)
    tick_values.push_back(tick);
  return tick_values;
}

std::vector<std::string> list_plot_files(const std::string& name) {
  return {name + "_plot.json", name + ".png", kScriptName};
}

std::optional<RunningProgram> start_python() {
  const std::vector<fs::path> pythons = os::programs_of_path("python3", "/usr/bin:/bin");
  if (pythons.empty()) return std::nullopt;
  // The first Python found is tried first; the others are passed on, in case the first has no
  // matplotlib.
  std::vector<std::string> command = {pythons.front().string(), "-c", kPlotScript, "-", "-"};
  for (std::size_t i = 1; i < pythons.size(); ++i) command.push_back(pythons[i].string());
  // The working folder is not that of the plot, where Python would import a json.py of the user.
  return RunningProgram::start(std::move(command), "/");
}

void begin_plot(RunningProgram& python, const Plot& plot) {
  python.begin(plot.data.dump(), kLimitSeconds, interrupted);
}

bool save_plots(const fs::path& folder, const std::vector<Plot>& plots,
                std::vector<std::string>& outputs, std::vector<Warning>& warnings,
                std::optional<RunningProgram> python) {
  std::string manual_commands;
  for (const Plot& plot : plots) {
    const auto saved = [&](const std::string& file) {
      outputs.push_back((folder / file).string());
      return folder / file;
    };
    save_text(saved(plot.name + "_plot.json"), plot.data.dump(1) + "\n");
    const std::string command = std::string("python3 ") + kScriptName + " " + plot.name +
                                "_plot.json " + plot.name + ".png";
    // If Python fails for one plot, it would fail for all.
    std::optional<ProgramResult> result;
    const std::string text = plot.data.dump();
    if (python && python->has_begun() && !python->has_begun_with_input(text)) python.reset();
    if (manual_commands.empty() && !python) python = start_python();
    if (manual_commands.empty() && python) {
      if (!python->has_begun()) python->begin(text, kLimitSeconds, interrupted);
      result = python->finish();
    }
    python.reset();
    if (interrupted()) return false;
    if (result && result->exit_code == kNoMatplotlib) result.reset();
    constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n";
    if (!result) {
      manual_commands += (manual_commands.empty() ? "" : " && ") + command;
    } else if (result->exit_code != 0 || result->output.substr(0, kPng.size()) != kPng) {
      constexpr std::size_t kMaxReasonBytes = 1000;
      std::string reason = result->errors.substr(0, kMaxReasonBytes);
      std::replace(reason.begin(), reason.end(), '\n', ' ');
      if (result->exit_code == 0) reason = "it wrote no PNG";
      warnings.push_back({"no-plot",
                          plot.name + ".png was not drawn: Python ended with exit code " +
                              std::to_string(result->exit_code) + ": " + reason,
                          1});
    } else {
      save_text(saved(plot.name + ".png"), result->output);
    }
  }
  if (!manual_commands.empty()) {
    save_text(folder / kScriptName, kPlotScript);
    outputs.push_back((folder / kScriptName).string());
    warnings.push_back({"no-plot",
                        (RunningProgram::is_supported()
                             ? "Python with matplotlib is not installed, so there is no picture: "
                               "install the package python3-matplotlib, then run '"
                             : "Kiln draws no plots on this system, so there is no picture: with "
                               "Python and matplotlib, run '") +
                            manual_commands + "' in " + folder.string() + ".",
                        1});
  }
  return true;
}

}  // namespace kiln::cli
