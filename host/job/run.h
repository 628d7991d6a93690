// kiln::run() with what its callers within Kiln add: the command, Python and `kiln run`.
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
#include "kiln/kiln.h"
#include "kiln/plan.h"
#include "kiln/simplify.h"

namespace kiln {

/// Progress of a run, its warnings, and the lines that summarise it. Stages append to it.
class RunLog {
 public:
  /// \param on_line  receives each line at once; may be empty
  RunLog(Progress progress, std::function<void(const Message&)> on_line)
      : progress_(std::move(progress)), on_line_(std::move(on_line)) {}

  /// Reports the share of the whole work that is done. \returns false if the caller cancels
  bool goes_on(double share, std::string_view stage) const {
    return !progress_ || progress_(share, stage);
  }
  /// The same. \throws Cancelled
  void progress(double share, std::string_view stage) const {
    if (!goes_on(share, stage)) throw Cancelled{};
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

/// A high poly on the device, repaired and with the normals that it is baked with.
struct PreparedHigh {
  const Source& source;
  const Mesh& mesh;
  std::span<const Material> materials =
      {};                      ///< Of the mesh; empty: read from the file that Job::high names
  bool height_field = false;   ///< The mesh is that of a height field
  bool faces_inwards = false;  ///< inward_parts() found some
};

/// Results of a bake before they are written. RunHooks::on_baked may move them out, except for result.report.
struct BakedJob {
  BakeResult& result;
  std::optional<PlannedBake>& planned;  ///< With --match auto
  const LowPolyPlan* plan;              ///< Null: the low poly was not planned
  const SimplifyReport* simplified;     ///< Null: the low poly was given
};

/// Additions of a caller to a run: the command draws plans, Python bakes from its sources and samples functions.
struct RunHooks {
  /// Names of the files that draw_plan may write.
  std::function<std::vector<std::string>(const std::string& stem)> plan_files;
  std::function<void()> on_start;  ///< Called after options are checked, before anything is read
  /// Called as soon as a plan is chosen, before its maps are baked at their full quality.
  std::function<void(const LowPolyPlan&, const std::string& stem)> on_plan;
  /// \returns false if it was cancelled
  std::function<bool(const LowPolyPlan&, const std::string& folder, const std::string& stem,
                     std::vector<std::string>& outputs, std::vector<Warning>& warnings)>
      draw_plan;
  std::function<void(const Message&)> line;  ///< Receives each line of the summary at once
  /// Makes the source of a high poly, or returns one of the same mesh from another run. Empty: it is made.
  std::function<Source(const Device&, const Mesh&, RayTraversal)> make_source;

  const PreparedHigh* high = nullptr;  ///< Replaces Job::high, which then only names it
  /// Returns images by the names of their slots in a material. They replace the maps of these names. Called once, with
  /// the points of the high poly that the texels match. Values are as files hold them.
  std::function<std::map<std::string, Image>(const Match&, const Mesh& high)> sample;
  std::set<std::string> not_written;  ///< Maps that are baked, but not written into the asset
  bool needs_uvs = false;             ///< Unwrap the low poly even if its plan needs no map
  bool writes = true;                 ///< False: on_baked takes the maps
  std::function<void(BakedJob&)>
      on_baked;  ///< Called before anything is written; for one texture set only
};

/// run() with hooks. Cancelled is no error here, but JobResult::cancelled. \param device  called once the options are
/// checked
JobResult run_job(const std::function<Device()>& device, const Job& job, const Progress& progress,
                  const RunHooks& hooks);

}  // namespace kiln
