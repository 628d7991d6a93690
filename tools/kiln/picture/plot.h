// Pictures of data: C++ writes what they show, picture/plot.py draws it.
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
  Json data;  ///< As picture/plot.py reads it; saved as NAME_plot.json
};

/// A panel of a plot of curves, which has none yet.
Json plot_panel(const std::string& y_title);
/// A curve of a list's elements. \param look  as the script knows it: a name, or a share from light to dark
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

/// Ticks of a logarithmic axis: powers of four around all of it.
Json ticks_around(double least, double most);

/// The files that save_plots() may write.
std::vector<std::string> plot_files(const std::string& name);

/// A Python that gets ready to draw: reading matplotlib takes a third of a second, in which others can work.
/// \returns nothing where PATH has no python3
std::optional<RunningProgram> start_python();

/// Lets it draw a plot: save_plots() takes the picture where it is given the same plot.
void begin_plot(RunningProgram& python, const Plot& plot);

/// Saves what plots show, and draws them by the first python3 of PATH that has matplotlib. Where there is
/// none, a warning says what to install, and the script comes along to draw them by hand.
/// \param outputs,warnings  files written, and what went wrong; added to
/// \param python  what start_python() started before; for the first plot
/// \returns false where interrupted
/// \throws Error(output)
bool save_plots(const std::filesystem::path& folder, const std::vector<Plot>& plots,
                std::vector<std::string>& outputs, std::vector<Warning>& warnings,
                std::optional<RunningProgram> python = start_python());

}  // namespace kiln::cli
