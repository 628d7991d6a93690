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
  std::string name;  ///< Unique name: the texts of the captures, or the first file's name
  Job job;
  std::vector<Setting> settings;  ///< Effective settings, sorted by key
  std::size_t rule = 0;           ///< Index of the asset's [[bake]] rule
  std::string problem;            ///< Why the asset cannot be baked; empty if no problem is known
  unsigned retries = 0;
  double timeout = 0;         ///< Maximum time of the bake in seconds; 0: no limit
  std::string before, after;  ///< Shell commands that run before and after the bake; empty: none
  double expected_seconds = 0;
};

struct ExpandOptions {
  bool allow_outside = false;   ///< True if outputs may lie outside the job file's folder
  bool allow_own_maps = false;  ///< True if the file may use own maps, which are OpenCL C code
  bool allow_hooks = false;     ///< True if the file may contain hooks, which are shell commands
  /// Patterns of the names of the assets to bake; empty: all assets
  std::vector<std::string> only;
  OptionLayer command_line{"command line", {}};
};

struct Batch {
  std::vector<BatchAsset> assets;
  std::vector<Warning> warnings;
};

/// Finds the files of each [[bake]], and creates a job for each asset.
/// \throws Error(usage) with the line for errors in the file, such as two bakes with the same output
Batch expand_job_file(const JobFile& file, const ExpandOptions& options);

/// The output that identifies a job in messages and checks: its folder and stem, or its file.
std::string output_name(const Job& job);

/// Absolute paths of the files that a job writes. Before the bake, only the maps of one texture set are known.
std::vector<std::string> known_outputs(const Job& job);

/// Estimated seconds of a job, from sizes of files and maps; used to order and to list jobs.
double expected_seconds(const Job& job);

}  // namespace kiln
