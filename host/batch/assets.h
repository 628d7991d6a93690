// The bakes of a job file, one an asset.
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
  std::string name;  ///< Unlike any other's: the texts of its captures, or its first file's name
  Job job;
  std::vector<Setting> settings;  ///< In force, by key
  std::size_t rule = 0;           ///< Which [[bake]]
  std::string problem;            ///< Why it cannot be baked; empty: nothing is known to be wrong
  unsigned retries = 0;
  double timeout = 0;         ///< Seconds; 0: none
  std::string before, after;  ///< Commands; empty: none
  double expected_seconds = 0;
};

struct ExpandOptions {
  bool allow_outside = false;     ///< Outputs may lie outside of the job file's folder
  bool allow_own_maps = false;    ///< The file may name maps of OpenCL C
  bool allow_hooks = false;       ///< The file may name commands
  std::vector<std::string> only;  ///< Patterns of names; none: all
  OptionLayer command_line{"command line", {}};
};

struct Batch {
  std::vector<BatchAsset> assets;
  std::vector<Warning> warnings;
};

/// Finds the files of each [[bake]], and makes a job for each asset.
/// \throws Error(usage) for what is wrong with the file, such as two bakes of one output: with its line
Batch expand_job_file(const JobFile& file, const ExpandOptions& options);

/// Folder, stem and files that a job writes, as far as they are known before: for messages and checks.
std::string output_name(const Job& job);

/// Absolute paths of the files that a job writes, as far as they are known before: with the maps of one texture set.
std::vector<std::string> known_outputs(const Job& job);

/// Estimated seconds of a job, from sizes of files and maps. For order and lists.
double expected_seconds(const Job& job);

}  // namespace kiln
