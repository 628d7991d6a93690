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
  not_run,  ///< The run ended before its turn
  baked,
  unchanged,  ///< Up to date
  restored,   ///< Its files were copied from the cache
  failed,     ///< Its files were not written, unless it only exceeded a limit
  cancelled,  ///< The run was interrupted
};
const char* name_of(AssetState state);

/// The result of one asset's bake.
struct AssetResult {
  std::string name;
  AssetState state = AssetState::not_run;
  double seconds = 0;  ///< Wall-clock time of all attempts
  unsigned attempts = 0;
  std::string error;     ///< Why it failed
  std::string error_id;  ///< Error::id() of the failure
  int error_code = 0;    ///< ErrorCode of the failure; 1: a limit was exceeded
  std::vector<std::string> files;
  std::vector<Warning> causes;
  Json warnings = Json::array();
  double missed = 0;   ///< Share of missed samples, 0 to 1
  std::string reason;  ///< Why it was baked or restored
  std::string report;  ///< JSON report of the bake, as from `kiln bake --json`; empty: none
};

struct RunBatchOptions {
  std::string device;          ///< See --device
  BakeCache* cache = nullptr;  ///< Earlier results; null: bakes all assets and stores nothing
  bool rebake = false;         ///< Bakes all assets, and stores the results
  unsigned at_once =
      0;  ///< Concurrent bakes; 0: two if there are two threads, fewer if memory is short
  std::function<bool()> interrupted;  ///< Polled; true cancels the run. Empty: never cancelled
  /// Runs a shell command with `input` on its standard input. \param said out: its output \returns its exit code
  std::function<int(const std::string& command, const std::string& input, std::string& said)>
      run_command;
  /// Checks an asset that is baked, unchanged or restored. It fails if any problem is returned. Called concurrently.
  /// Empty: no checks
  std::function<std::vector<std::string>(const BatchAsset&, const AssetResult&)> check;
  /// Called after each asset, from one thread at a time. May be empty.
  std::function<void(const BatchAsset&, const AssetResult&)> on_result;
  /// Called with the completed share and the current stage, from one thread at a time. May be empty.
  std::function<void(double share, std::string_view stage)> on_progress;
};

/// Runs all bakes; a failure does not stop the others. Needs an open OutputSet: the files of an asset are placed
/// together as soon as it is done, and discarded if it fails.
/// \returns one result per asset, in the same order
std::vector<AssetResult> run_batch(const std::vector<BatchAsset>& assets,
                                   const RunBatchOptions& options);

/// Decides for each asset whether it would be baked, and why (a dry run). \param device see RunBatchOptions::device
std::vector<CacheDecision> plan_batch(const std::vector<BatchAsset>& assets, BakeCache& cache,
                                      const std::string& device);

/// An asset and its result as one object, for `--json -`, reports and hooks.
Json to_json(const BatchAsset& asset, const AssetResult& result);

}  // namespace kiln
