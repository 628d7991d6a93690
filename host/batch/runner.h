// Runs the bakes of a job file in one process.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "batch/assets.h"
#include "batch/bake_cache.h"
#include "kiln/device.h"
#include "kiln/job.h"
#include "options/json.h"

namespace kiln {

enum class AssetState : std::uint8_t {
  not_run,  ///< The run ended before
  baked,
  unchanged,  ///< Nothing was to do
  restored,   ///< Its files came from the cache
  failed,     ///< Nothing of it was written, but where a limit was missed
  cancelled,  ///< The run was interrupted
};
const char* name_of(AssetState state);

/// What a bake of a job file came to.
struct AssetResult {
  std::string name;
  AssetState state = AssetState::not_run;
  double seconds = 0;  ///< By the clock, all attempts
  unsigned attempts = 0;
  std::string error;     ///< Why it failed
  std::string error_id;  ///< Error::id() of it
  int error_code = 0;    ///< ErrorCode of it; 1: a limit was missed
  std::vector<std::string> files;
  std::vector<Warning> causes;
  Json warnings = Json::array();
  double missed = 0;   ///< Share of samples that were missed, 0 to 1
  std::string reason;  ///< Why it was baked, or taken from the cache
  std::string report;  ///< JSON of the bake, as --json of kiln bake; empty: none
};

struct RunBatchOptions {
  std::string device;          ///< As --device
  BakeCache* cache = nullptr;  ///< What was baked before; null: all is baked, and nothing kept
  bool rebake = false;         ///< All is baked, and kept
  unsigned at_once =
      0;  ///< Bakes at once; 0: two where there are two threads, fewer where memory is short
  std::function<bool()> interrupted;  ///< Polled. Empty: never
  /// Runs a command with a text on its standard input. \param said  out: what it wrote \returns its exit code
  std::function<int(const std::string& command, const std::string& input, std::string& said)>
      run_command;
  /// What is wrong with an asset that is baked, unchanged or restored; it has failed then. Several at once. Empty: nothing is
  std::function<std::vector<std::string>(const BatchAsset&, const AssetResult&)> check;
  /// After each asset, one at a time. Empty: nothing.
  std::function<void(const BatchAsset&, const AssetResult&)> on_result;
  /// The share that is done, and what is being done, one at a time. Empty: nothing.
  std::function<void(double share, std::string_view stage)> on_progress;
};

/// Runs all bakes. One that fails does not stop the others. An OutputSet is to be open: the files of an asset are placed
/// together as soon as it is done, those of one that failed never.
/// \returns a result for each asset, in their order
std::vector<AssetResult> run_batch(const std::vector<BatchAsset>& assets,
                                   const RunBatchOptions& options);

/// What would be done for each asset, and why. \param device  as RunBatchOptions::device
std::vector<CacheDecision> plan_batch(const std::vector<BatchAsset>& assets, BakeCache& cache,
                                      const std::string& device);

/// An asset, and what it came to, as one object: of --json -, of reports, and for hooks.
Json to_json(const BatchAsset& asset, const AssetResult& result);

}  // namespace kiln
