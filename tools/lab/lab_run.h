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

/// Progress of work in steps.
class Steps {
 public:
  explicit Steps(Progress progress) : progress_(std::move(progress)) {}

  double count = 1, done = 0;

  /// Starts a step. \returns false if cancelled
  bool at(const std::string& stage) {
    stage_ = stage;
    return show(0);
  }
  /// Returns a progress callback for a call that makes up one step, or a share of a step.
  Progress within(double share = 1) {
    return [this, share](double part, std::string_view) { return show(share * part); };
  }

 private:
  bool show(double more) const { return progress_((done + more) / count, stage_); }

  Progress progress_;
  std::string stage_;
};

/// A run of a command: its messages, report and output files.
struct LabRun {
  /// Prepares the output folder and the destination of the report. \throws Error(output)
  explicit LabRun(const LabArguments& arguments);

  /// Returns a progress callback for a step that takes the run's progress from one fraction to another, each 0 to 1.
  /// The run must outlive it.
  Progress within(double from, double to);
  /// Ends a stage and adds its seconds to the report.
  void record_stage(const char* stage) { seconds[stage] = watch.lap(); }
  /// Saves the report, and prints warnings, lines and files. \returns the exit code
  int end();

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
