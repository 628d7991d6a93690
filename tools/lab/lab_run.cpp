#include "lab/lab_run.h"

#include "job/files.h"
#include "kiln/files.h"

namespace kiln::cli {

LabRun::LabRun(const LabArguments& arguments)
    : console(arguments.quiet, arguments.json), json(arguments.json) {
  if (!arguments.out.empty()) prepare_output_folder(arguments.out);
  if (!json.empty()) prepare_parent(json);
}

Progress LabRun::partial_progress(double from, double to) {
  return [this, from, to](double done, std::string_view stage) {
    return console.progress(from + (to - from) * done, stage);
  };
}

int LabRun::finish() {
  if (!json.empty()) {
    add_closing_keys(report, seconds, watch, outputs, warnings);
    save_report(json, report);
  }
  console.progress(1, "done");
  print_warnings(console, warnings, settings_warnings, json.empty() ? "--json" : json);
  for (const std::string& line : lines) console.line(line);
  for (const std::string& output : outputs) console.line("wrote " + output);
  return 0;
}

}  // namespace kiln::cli
