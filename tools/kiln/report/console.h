// What a person sees while the command works.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"

namespace kiln::cli {

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
  void warning(const std::string& text);

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

/// Every general warning; and of the settings' every kind once, with how often it came.
/// \param report  where the others are: "see REPORT"
void print_warnings(Console& console, const std::vector<Warning>& general,
                    const std::vector<Warning>& of_settings, const std::string& report);

}  // namespace kiln::cli
