// Runs the bakes of a job file in one process.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "batch/assets.h"
#include "batch/bake_cache.h"
#include "options/json.h"

namespace kiln {

enum class AssetState : std::uint8_t {
  not_run,  ///< The run ended before the asset was started
  baked,
  unchanged,  ///< The outputs are up to date
  restored,   ///< The files were copied from the cache
  /// Either the bake failed, and no files were written; or the files were written, but exceed a limit of [check]
  failed,
  cancelled,  ///< The run was interrupted
};
const char* name_of(AssetState state);

/// The result of one asset's bake.
struct AssetResult {
  std::string name;
  AssetState state = AssetState::not_run;
  double seconds = 0;  ///< Wall-clock time of all attempts
  unsigned attempts = 0;
  std::string error;     ///< The error message of a failed asset
  std::string error_id;  ///< Error::id() of a failed asset
  int error_code = 0;    ///< ErrorCode of a failed asset; 1 if its outputs exceed a limit
  std::vector<std::string> files;
  std::vector<Warning> causes;
  Json warnings = Json::array();
  double missed = 0;   ///< Share of missed samples, 0 to 1
  std::string reason;  ///< Reason why the asset was baked or restored, instead of being unchanged
  std::string report;  ///< JSON report of the bake, as from `kiln bake --json`; empty: none
};

struct RunBatchOptions {
  std::string device;  ///< Name of the device, as for --device
  /// Cache of results; if null, all assets are baked and no result is stored
  BakeCache* cache = nullptr;
  /// True to bake all assets even if they are unchanged, and to store the results
  bool rebake = false;
  /// Number of concurrent bakes; 0: two if there are two threads, but fewer if memory is short
  unsigned concurrent_bakes = 0;
  /// Function that the run polls; if it returns true, the run is cancelled. May be empty
  std::function<bool()> interrupted;
  /// Runs a shell command with `input` on its standard input.
  /// \param output  receives the command's output
  /// \returns the command's exit code
  std::function<int(const std::string& command, const std::string& input, std::string& output)>
      run_command;
  /// Checks an asset that was baked, unchanged or restored. The asset fails if the returned list of problems is not
  /// empty. Called concurrently. May be empty
  std::function<std::vector<std::string>(const BatchAsset&, const AssetResult&)> check;
  /// Called after each asset, from one thread at a time. May be empty.
  std::function<void(const BatchAsset&, const AssetResult&)> on_result;
  /// Called with the completed share and the current stage, from one thread at a time. May be empty.
  std::function<void(double share, std::string_view stage)> on_progress;
};

/// Runs all bakes; a failure does not stop the others. Needs an open OutputSet: the files of an asset are placed
/// together as soon as the asset is finished, and discarded if it fails.
/// \returns one result per asset, in the same order
std::vector<AssetResult> run_batch(const std::vector<BatchAsset>& assets,
                                   const RunBatchOptions& options);

/// Decides for each asset whether it would be baked, and why (a dry run).
/// \param device  see RunBatchOptions::device
std::vector<CacheDecision> plan_batch(const std::vector<BatchAsset>& assets, BakeCache& cache,
                                      const std::string& device);

/// Describes an asset and its result as one JSON object, for `--json -`, reports and hooks.
Json to_json(const BatchAsset& asset, const AssetResult& result);

}  // namespace kiln
