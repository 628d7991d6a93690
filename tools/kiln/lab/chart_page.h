// Panels of seconds against errors, drawn by gnuplot: what all charts share.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace kiln::cli {

/// Marks that are drawn alike.
struct ChartStyle {
  std::string family;  ///< In the file of data
  std::string title;
  std::string mark;  ///< As gnuplot draws it: pt, ps, lc
};

struct ChartMark {
  std::string label;
  double seconds = 0;
  std::vector<double> runs;  ///< Seconds of each
  double error = 0;
  bool on_front = false;
};

/// One measure of one group: errors, 0 or above, against seconds.
struct ChartPanel {
  std::string name;  ///< Of the measure, in file and script: letters, digits, _
  std::string title;
  std::string unit;  ///< Of the errors
  int column = 0;    ///< Of the errors in the file of data
  std::vector<ChartMark> marks;
};

/// A row of panels, two a line.
struct ChartGroup {
  std::string title, note;  ///< note: may be empty
  std::vector<ChartPanel> panels;
};

/// NAME.csv, which lies beside the script, has a line of names, then a line a mark: 1 the group's number
/// from 1, 3 the family, 4 the seconds.
struct ChartPage {
  std::string name;
  std::string title, subtitle, seconds_title;
  int least_column = 0, most_column = 0;  ///< Seconds of the fastest and the slowest run
  std::vector<ChartStyle> styles;         ///< That occur
  std::vector<ChartGroup> groups;
};

/// Ends a subtitle: how many runs the seconds come from.
std::string runs_note(unsigned repeat);

/// A gnuplot script that draws NAME.csv to NAME.png, or to standard output where the variable to_stdout exists.
std::string page_script(const ChartPage& page);

}  // namespace kiln::cli
