// Runs the lab's commands: progress, reports and exit codes.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "job/describe.h"
#include "kiln/error.h"
#include "kiln/types.h"
#include "kiln/version.h"
#include "lab/lab_arguments.h"
#include "report/console.h"

namespace kiln::cli {

/// Divides the progress of some work into `count` steps of equal length.
class Steps {
 public:
  explicit Steps(Progress progress) : progress_(std::move(progress)) {}

  double count = 1, done = 0;  ///< Number of all steps, and of the completed ones

  /// Starts a step, whose name progress reports show. \returns false if cancelled
  bool start(const std::string& stage) {
    stage_ = stage;
    return report(0);
  }
  /// Returns a progress callback for a call whose work is one step, or this share of a step.
  Progress step_progress(double share = 1) {
    return [this, share](double part, std::string_view) { return report(share * part); };
  }

 private:
  bool report(double more) const { return progress_((done + more) / count, stage_); }

  Progress progress_;
  std::string stage_;
};

/// One run of a lab command: its console messages, its report and its output files.
struct LabRun {
  /// Prepares the output folder and the destination of the report. \throws Error(output)
  explicit LabRun(const LabArguments& arguments);

  /// Returns a progress callback that maps 0 to 1 onto the range from `from` to `to` of the whole run's progress, which
  /// is 0 to 1 as well. The run must outlive the callback.
  Progress partial_progress(double from, double to);
  /// Ends a stage, and adds the seconds since the end of the previous stage to the report.
  void record_stage(const char* stage) { seconds[stage] = watch.lap(); }
  /// Saves the report, and prints the warnings, the lines and the names of the output files.
  /// \returns the exit code
  int finish();

  Console console;
  Stopwatch watch;
  std::string json;  ///< File of the report; empty: none
  Json report = {{"version", version()}};
  Json seconds = Json::object();
  /// Warnings about the whole run, and about single settings
  std::vector<Warning> warnings, settings_warnings;
  std::vector<std::string> outputs, lines;
};

}  // namespace kiln::cli
