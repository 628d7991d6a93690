// Plots by gnuplot: what all scripts share.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace kiln::cli {

/// Inside single quotes of gnuplot, without its markup.
std::string quoted(const std::string& text);

std::string join(const std::vector<std::string>& parts, const char* between);

/// A number as people write it: "0.05", "2000".
std::string text_of(double value);

/// A number as data: nine digits.
std::string exact_text(double value);

/// Of an axis, for "set xtics (...)": 1, 2 and 5 times the powers of ten, as plain numbers.
/// \param above  none at or below this
std::string logarithmic_tics(double above = 0);

/// Draws NAME.csv to NAME.png in its own folder, or to standard output where the variable to_stdout exists.
/// \param width,height  pixels
/// \param title  lines of the script that end it
std::string plot_header(const std::string& name, int width, int height, const std::string& title);

/// Runs gnuplot on FOLDER/NAME.gp and saves FOLDER/NAME.png. \returns why there is none, or nothing
/// \throws Error(output)
std::string draw_plot(const std::filesystem::path& folder, const std::string& name);

}  // namespace kiln::cli
