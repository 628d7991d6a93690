// Expands a job file into its assets: one bake each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "batch/job_file.h"
#include "kiln/job.h"
#include "kiln/types.h"

namespace kiln {

/// One bake of a job file.
struct BatchAsset {
  std::string
      name;  ///< Unique name: the captured texts, joined by "/"; without captures the stem of the first file
  Job job;
  std::vector<Setting>
      settings;  ///< The settings that apply to this asset, after the merge of all layers; sorted by key
  std::size_t rule = 0;  ///< Index of the [[bake]] table from which the asset comes
  std::string problem;   ///< Why the asset cannot be baked; empty if no problem is known
  unsigned retries = 0;
  double timeout = 0;           ///< Maximum time of the bake in seconds; 0: no limit
  std::string before, after;    ///< Shell commands that run before and after the bake; empty: none
  double expected_seconds = 0;  ///< Estimated seconds of the bake; see expected_seconds()
};

struct ExpandOptions {
  bool allow_outside = false;   ///< True if outputs may lie outside the job file's folder
  bool allow_own_maps = false;  ///< True if the file may define maps by OpenCL C code
  bool allow_hooks = false;     ///< True if the file may contain hooks, which are shell commands
  /// Patterns of the names of the assets to bake; empty: all assets
  std::vector<std::string> selected_names;
  OptionLayer command_line{"command line", {}};
};

struct Batch {
  std::vector<BatchAsset> assets;
  std::vector<Warning> warnings;
};

/// Finds the files that each [[bake]] table names, and creates a job for each asset.
/// \throws Error(usage) with the line for errors in the file, such as two bakes with the same output
Batch expand_job_file(const JobFile& file, const ExpandOptions& options);

/// Returns the output path that identifies a job in messages and checks: the file of an asset, or the folder and the
/// stem of a set of maps.
std::string output_name(const Job& job);

/// Returns the absolute paths of the files that a job will write. If the low poly has several texture sets, the maps of
/// only one set are listed, because the sets are unknown before the bake.
std::vector<std::string> known_outputs(const Job& job);

/// Estimates the seconds of a job from the sizes of its files and maps, to order and to list jobs.
double expected_seconds(const Job& job);

}  // namespace kiln
