// Prints progress, warnings and the summary on the terminal.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/types.h"
#include "options/json.h"

namespace kiln::cli {

/// Makes a text safe for terminals. Control characters, with which a file's name could move the cursor, and invalid
/// UTF-8 become \xNN. Line breaks and tabs are kept.
std::string printable(std::string_view text);

/// Returns the first characters of a printable text, up to a width in columns.
std::string_view first_columns(std::string_view text, std::size_t columns);

/// Prints a message with a line break, and flushes. All messages of the command pass through here. Further lines of a
/// message are indented, so that a file's name, which may contain line breaks, cannot fake a line of a log.
void print_line(std::FILE* to, std::string_view text);
/// Prints a text of several lines, such as a job file, unchanged with a line break, and flushes.
void print_text(std::FILE* to, std::string_view text);

/// Closes standard output. It is no error if the reader has closed its end, as `head` does. \throws Error(output) if
/// standard output is closed, or its disk is full
void finish_output();

/// A progress bar on a terminal. In logs, which should hold only results and warnings, there is no bar. The bar and
/// warnings go to standard error, results to standard output. Quiet suppresses the bar and results, but no warnings.
class Console {
 public:
  /// Creates the console. \param report  destination of the command's report; "-" reserves standard output for it, and
  /// lines go to standard error
  explicit Console(bool quiet, const std::string& report = {});
  ~Console();

  /// Shows the completed share of the work. \returns false if the user interrupted
  bool progress(double share, std::string_view stage);
  /// Returns a callback that shows the stages of a call; the completed share stays at `share`.
  Progress stages_at_share(double share) {
    return [this, share](double, std::string_view stage) { return progress(share, stage); };
  }
  /// Prints a line of the results.
  void line(const std::string& text);
  /// Prints a warning, which names options by their flags.
  void warning(const Message& message);

 private:
  void clear_bar();
  bool quiet_;
  bool report_on_output_;
  bool terminal_;
  bool bar_shown_ = false;
  std::string last_stage_;
  int last_percent_ = -1;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Estimates the remaining time by linear extrapolation, as "about 40 s left, ". Empty at the beginning, when an
/// estimate is unreliable.
/// \param seconds  elapsed time
std::string time_left(double share, double seconds);

/// Prints all general warnings. Each kind of warning about settings is printed once, with the
/// number of its occurrences.
/// \param report  file that lists all warnings, for "see REPORT"
void print_warnings(Console& console, const std::vector<Warning>& general,
                    const std::vector<Warning>& of_settings, const std::string& report);

/// Writes a report to a file, or to standard output if the path is "-". \throws Error(output)
void save_report(const std::filesystem::path& path, const Json& report);
/// Writes the text of a report to a file, or to standard output if the path is "-". \throws Error(output)
void save_report(const std::filesystem::path& path, const std::string& report);

}  // namespace kiln::cli
