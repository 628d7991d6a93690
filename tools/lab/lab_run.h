// Shared by runs of the lab's commands: progress and exit codes.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "job/describe.h"
#include "kiln/kiln.h"
#include "lab/lab_arguments.h"
#include "report/console.h"

namespace kiln::cli {

/// Progress of work in steps.
class Steps {
 public:
  explicit Steps(Progress progress) : progress_(std::move(progress)) {}

  double count = 1, done = 0;

  /// Says what is done next. \returns false where progress said stop
  bool at(const std::string& stage) {
    stage_ = stage;
    return show(0);
  }
  /// The callback of a call that is a step, or so much of one.
  Progress within(double share = 1) {
    return [this, share](double part, std::string_view) { return show(share * part); };
  }

 private:
  bool show(double more) const { return progress_((done + more) / count, stage_); }

  Progress progress_;
  std::string stage_;
};

/// A run: what it has to say, and what it leaves.
struct LabRun {
  /// Prepares the folder and the report's place. \throws Error(output)
  explicit LabRun(const LabArguments& arguments);

  /// A callback of work that begins and ends at such shares of the whole. The run outlives it.
  Progress within(double from, double to);
  /// Ends a stage, whose seconds the report has.
  void lap(const char* stage) { seconds[stage] = watch.lap(); }
  /// Saves the report, and prints warnings, lines and files. \returns the exit code
  int end();

  Console console;
  Stopwatch watch;
  std::string json;  ///< Where the report goes; empty: nowhere
  Json report = {{"version", version()}};
  Json seconds = Json::object();
  std::vector<Warning> warnings, of_settings;  ///< Of all of the work, and of single settings
  std::vector<std::string> outputs, lines;
};

}  // namespace kiln::cli
