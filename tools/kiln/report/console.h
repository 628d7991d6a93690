// Progress, warnings and the summary on the terminal.
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

/// Makes a text safe for terminals: control characters, with which a file's name could move the cursor, and invalid
/// UTF-8 become \xNN. Line breaks and tabs are kept.
std::string printable(std::string_view text);

/// The first `columns` characters of a printable text.
std::string_view first_columns(std::string_view text, std::size_t columns);

/// Prints a message with a line break, and flushes. All messages of the command pass through here. Further lines of a
/// message are indented, so that a file's name, which may contain line breaks, cannot fake a line of a log.
void print_line(std::FILE* to, std::string_view text);
/// Prints a text of several lines, such as a job file, unchanged with a line break, and flushes.
void print_text(std::FILE* to, std::string_view text);

/// Standard output to where it goes. A reader that has left, as `head` does, has read what it wanted: that is no
/// error. \throws Error(output) where it is closed, or its disk is full
void finish_output();

/// A progress bar on a terminal, and none elsewhere: logs hold results and warnings alone. The bar and
/// warnings go to standard error, so that standard output stays for results. Quiet leaves out the bar and
/// results; warnings stay.
class Console {
 public:
  /// \param report  destination of the command's report; "-" reserves standard output for it, and lines go to standard
  ///                error
  explicit Console(bool quiet, const std::string& report = {});
  ~Console();

  /// Shows that `share` of the work is complete. \returns false if the user interrupted
  bool progress(double share, std::string_view stage);
  /// A callback that shows the stages of a call without advancing the share.
  Progress stages_at(double share) {
    return [this, share](double, std::string_view stage) { return progress(share, stage); };
  }
  /// Prints a line of results.
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

/// "about 40 s left, ": linear extrapolation of the elapsed time. Empty at the beginning, when an estimate is
/// unreliable. \param seconds elapsed time
std::string time_left(double share, double seconds);

/// Prints all general warnings, and each kind of the settings' warnings once with its count.
/// \param report  the report that lists all: "see REPORT"
void print_warnings(Console& console, const std::vector<Warning>& general,
                    const std::vector<Warning>& of_settings, const std::string& report);

/// Writes a report to a file, or to standard output if the path is "-". \throws Error(output)
void save_report(const std::filesystem::path& path, const Json& report);
/// Writes the text of a report in the same way.
void save_report(const std::filesystem::path& path, const std::string& report);

}  // namespace kiln::cli
