// Saves plots: C++ writes their data, picture/plot.py draws them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/running_program.h"
#include "job/describe.h"

namespace kiln::cli {

/// One picture, NAME.png.
struct Plot {
  std::string name;
  Json data;  ///< Input of picture/plot.py, saved as NAME_plot.json
};

/// Makes an empty panel for a plot of curves.
Json plot_panel(const std::string& y_title);
/// Makes a curve with one point per element of a list.
/// \param look  a style name that plot.py defines (CURVE_STYLES), or a shade from 0 (light) to 1 (dark)
template <typename List, typename X, typename Y>
Json plot_curve(const std::string& title, const Json& look, const List& list, const X& x,
                const Y& y) {
  Json curve = {{"title", title}, {"look", look}, {"x", Json::array()}, {"y", Json::array()}};
  for (const auto& element : list) {
    curve["x"].push_back(x(element));
    curve["y"].push_back(y(element));
  }
  return curve;
}

/// Returns ticks of a logarithmic axis: the powers of four that enclose a range.
Json power_of_four_ticks(double least, double most);

/// Returns the names of the files that save_plots() may write.
std::vector<std::string> list_plot_files(const std::string& name);

/// Starts Python in advance, because importing matplotlib takes a third of a second.
/// \returns nullopt if PATH has no python3
std::optional<RunningProgram> start_python();

/// Starts drawing a plot. If save_plots() gets the same plot, it uses the picture.
void begin_plot(RunningProgram& python, const Plot& plot);

/// Saves the data of plots, and draws them with the first python3 in PATH that has matplotlib. Without one, a warning
/// names the package to install, and the script is saved to draw the plots later.
/// \param outputs,warnings  written files and warnings are appended to these
/// \param python  result of start_python(); used for the first plot
/// \returns false if interrupted
/// \throws Error(output)
bool save_plots(const std::filesystem::path& folder, const std::vector<Plot>& plots,
                std::vector<std::string>& outputs, std::vector<Warning>& warnings,
                std::optional<RunningProgram> python = start_python());

}  // namespace kiln::cli
