// run_job(): kiln::run() with hooks for callers within Kiln, which are the command, Python and `kiln run`.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/progress_guard.h"
#include "kiln/job.h"
#include "kiln/plan.h"
#include "kiln/simplify.h"

namespace kiln {

/// Collects the warnings and summary lines of a run, and reports its progress. Stages append to it.
class RunLog {
 public:
  /// Creates an empty log. \param on_line  receives each summary line at once; may be empty
  RunLog(Progress progress, std::function<void(const Message&)> on_line)
      : progress_(std::move(progress)), on_line_(std::move(on_line)) {}

  /// Reports the completed share of the whole run, 0 to 1. \returns false if the caller cancels
  bool report_progress(double share, std::string_view stage) const {
    return !progress_ || progress_(share, stage);
  }
  /// Variant of report_progress() that throws if the caller cancels. \throws Cancelled
  void progress(double share, std::string_view stage) const {
    if (!report_progress(share, stage)) throw Cancelled{};
  }
  void line(const Message& text) {
    if (on_line_) on_line_(text);
    lines.push_back(text);
  }
  void warn(std::span<const Warning> list) {
    warnings.insert(warnings.end(), list.begin(), list.end());
  }

  std::vector<Message> lines;
  std::vector<Warning> warnings;

 private:
  Progress progress_;
  std::function<void(const Message&)> on_line_;
};

/// A high poly that is already on the device, repaired, and with its final normals.
struct PreparedHigh {
  const Source& source;
  const Mesh& mesh;
  std::span<const Material> materials =
      {};  ///< Materials of the mesh; if empty, they are read from the file that Job::high names
  bool height_field = false;   ///< True if the mesh is that of a height field
  bool faces_inwards = false;  ///< True if inward_parts() found parts that face inwards
};

/// Results of a bake before they are written. RunHooks::on_baked may move them out, except for result.report.
struct BakedJob {
  BakeResult& result;
  std::optional<PlannedBake>& planned;  ///< The plan of --match auto; nullopt without it
  const LowPolyPlan* plan;              ///< The plan of the low poly; null if it was not planned
  /// The report of the simplified low poly; null if LOW was given
  const SimplifyReport* simplified;
};

/// What a caller adds to a run: the command draws plans; Python bakes from its own sources, and samples functions.
struct RunHooks {
  /// Returns the names of the files that draw_plan may write.
  std::function<std::vector<std::string>(const std::string& stem)> plan_files;
  std::function<void()> on_start;  ///< Called after options are checked, before anything is read
  /// Called as soon as a plan is chosen, before its maps are baked in full quality.
  std::function<void(const LowPolyPlan&, const std::string& stem)> on_plan;
  /// Draws the charts of a plan, and writes them to files in a folder. \returns false if the caller cancelled
  std::function<bool(const LowPolyPlan&, const std::string& folder, const std::string& stem,
                     std::vector<std::string>& outputs, std::vector<Warning>& warnings)>
      draw_plan;
  std::function<void(const Message&)> line;  ///< Receives each line of the summary at once
  /// Makes the source of a high poly, or returns one of the same mesh from another run. If this function is empty,
  /// run_job() makes the source.
  std::function<Source(const Device&, const Mesh&, RayTraversal)> make_source;

  const PreparedHigh* high = nullptr;  ///< Replaces Job::high, which is then used only for its name
  /// Returns images for texture slots of a material, by the names of the slots. They replace the maps of the same
  /// names. Called once, with the points of the high poly that the texels match. The values must be as files store
  /// them.
  std::function<std::map<std::string, Image>(const Match&, const Mesh& high)> sample;
  /// Names of maps that are baked, but not written into the asset
  std::set<std::string> not_written;
  bool needs_uvs = false;  ///< True to unwrap the low poly even if its plan needs no map
  bool writes = true;      ///< False if on_baked takes the maps; the run then writes no file
  std::function<void(BakedJob&)>
      on_baked;  ///< Called before any file is written, and only for a LOW with one texture set
};

/// Runs a job with hooks. A cancelled run returns JobResult::cancelled instead of throwing.
/// \param device  opens the device; called once the options are checked
JobResult run_job(const std::function<Device()>& device, const Job& job, const Progress& progress,
                  const RunHooks& hooks);

}  // namespace kiln
