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

/// As a terminal may be given it: control characters, which a name in a file may hold to move the cursor or to
/// change the window, and bytes that are no UTF-8 become \xNN. Line breaks and tabs stay.
std::string printable(std::string_view text);

/// The first `columns` characters. \param text  printable
std::string_view first_columns(std::string_view text, std::size_t columns);

/// A message, and a line break. All that the command says of a run goes this way. Flushed. Where the message has line
/// breaks, further lines are indented: a file's name, in which line breaks are legal, cannot begin a line of a log.
void print_line(std::FILE* to, std::string_view text);
/// A text of any lines, such as a job file, as it stands, and a line break. Flushed.
void print_text(std::FILE* to, std::string_view text);

/// Standard output to where it goes. A reader that has left, as `head` does, has read what it wanted: that is no
/// error. \throws Error(output) where it is closed, or its disk is full
void finish_output();

/// A progress bar on a terminal, and none elsewhere: logs hold results and warnings alone. The bar and
/// warnings go to standard error, so that standard output stays for results. Quiet leaves out the bar and
/// results; warnings stay.
class Console {
 public:
  /// \param report  where the command's report goes: with "-", standard output is its alone, and lines go to
  ///                standard error
  explicit Console(bool quiet, const std::string& report = {});
  ~Console();

  /// Shows that `share` of the whole work is done. \returns false where the user interrupted
  bool progress(double share, std::string_view stage);
  /// A callback that shows a call's stages, all at one share.
  Progress stages_at(double share) {
    return [this, share](double, std::string_view stage) { return progress(share, stage); };
  }
  /// A line of result.
  void line(const std::string& text);
  /// A warning, with flags for the library's parameters.
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

/// "about 40 s left, ": what the rest takes where it goes on as the first share did. Empty at the beginning, when
/// nobody knows. \param seconds  that the share took
std::string time_left(double share, double seconds);

/// Every general warning; and of the settings' every kind once, with how often it came.
/// \param report  where the others are: "see REPORT"
void print_warnings(Console& console, const std::vector<Warning>& general,
                    const std::vector<Warning>& of_settings, const std::string& report);

/// Writes a report to a file, or to standard output where the path is "-". \throws Error(output)
void save_report(const std::filesystem::path& path, const Json& report);
/// The same of its text.
void save_report(const std::filesystem::path& path, const std::string& report);

}  // namespace kiln::cli
