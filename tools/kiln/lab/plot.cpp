#include "lab/plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <sstream>
#include <string_view>

#include "kiln/files.h"
#include "lab/program.h"

namespace kiln::cli {

std::string quoted(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (std::string_view("_^@{}~&\\").find(c) != std::string_view::npos) result += '\\';
    result += c == '\'' ? "''" : std::string(1, c);
  }
  return "'" + result + "'";
}

std::string join(const std::vector<std::string>& parts, const char* between) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : between) + part;
  return text;
}

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

std::string exact_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

std::string logarithmic_tics(double above) {
  std::vector<std::string> texts;
  for (int power = -9; power <= 9; ++power) {
    for (const int factor : {1, 2, 5}) {
      const double value = factor * std::pow(10.0, power);
      if (value <= above) continue;
      const std::string tic = text_of(value);
      texts.push_back("'" + tic + "' " + tic);
    }
  }
  return join(texts, ", ");
}

std::string plot_header(const std::string& name, int width, int height, const std::string& title) {
  std::ostringstream text;
  text << "# Draws " << name << ".png from " << name << ".csv: gnuplot " << name << ".gp\n"
       << "set terminal pngcairo size " << width << "," << height << " font 'sans,17' enhanced\n"
       << "if (!exists('to_stdout')) set output '" << name << ".png'\n"
       << "set datafile separator ','\n"
       << "set border 3 lw 1.2 lc rgb '#555555'\n"
       << "set grid x y lt 1 lw 1 lc rgb '#d8d8d8'\n"
       << "set tics nomirror textcolor rgb '#222222'\n"
       << "set key Left reverse samplen 2.5 spacing 1.25\n"
       << title;
  return text.str();
}

std::string draw_plot(const std::filesystem::path& folder, const std::string& name) {
  const std::string by_hand = "'gnuplot " + name + ".gp' in " + folder.string();
  const std::optional<ProgramResult> result =
      run_program({"gnuplot", "--default-settings", "-e", "to_stdout = 1", name + ".gp"}, folder);
  if (!result) {
    return "gnuplot is not installed, so there is no plot: install the package gnuplot-nox, then "
           "run " +
           by_hand + ".";
  }
  constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n";
  if (result->exit_code != 0 || result->output.substr(0, kPng.size()) != kPng) {
    std::string reason = result->errors;
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    return "gnuplot drew no plot (exit code " + std::to_string(result->exit_code) + "): " + reason +
           "Try " + by_hand + ".";
  }
  save_text(folder / (name + ".png"), result->output);
  return {};
}

}  // namespace kiln::cli
