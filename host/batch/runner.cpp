#include "batch/runner.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <new>
#include <optional>
#include <thread>

#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/stopwatch.h"
#include "batch/source_cache.h"
#include "io/file/output_set.h"
#include "job/describe.h"
#include "job/files.h"
#include "job/job_options.h"
#include "job/run.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/limits.h"
#include "kiln/option_error.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// Estimates the memory of a bake in bytes from the sizes of files and maps. The estimate limits the number of
/// concurrent bakes, so it is rather too high than too low.
std::uint64_t expected_bytes(const Job& job) {
  constexpr std::uint64_t kBaseBytes = std::uint64_t{32} << 20, kBytesPerFileByte = 8,
                          kBytesPerSample = 96, kBytesPerMapTexel = 24;
  std::uint64_t bytes = kBaseBytes;
  for (const auto* const mesh_files : {&job.high, &job.low.given}) {
    for (const JobInput& input : *mesh_files) {
      if (const auto facts = os::query_file(fs::path(input.name)))
        bytes += kBytesPerFileByte * facts->bytes;
    }
  }
  const std::uint64_t texels = std::uint64_t{job.bake.width} * job.bake.height;
  const std::uint64_t maps =
      job.bake.maps.size() + job.own_maps.size() + job.variants.size() + job.transfers.size();
  return bytes + texels * (kBytesPerSample * job.bake.samples * job.bake.samples +
                           kBytesPerMapTexel * std::max<std::uint64_t>(1, maps));
}

/// Finds out before the bake, which may take hours, whether an output file or its folder is write-protected.
/// \returns the reason why the outputs cannot be written; empty if they can
std::string unwritable_output(const Job& job) {
  for (const std::string& output : known_outputs(job)) {
    if (is_write_protected(output))
      return "'" + output + "' cannot be written: the file there is write-protected.";
    fs::path folder = fs::path(output).parent_path();
    while (!os::query_file(folder) && folder.has_parent_path() && folder != folder.parent_path()) {
      folder = folder.parent_path();
    }
    const auto folder_facts = os::query_file(folder);
    if (folder_facts && folder_facts->is_folder && !os::may_write_in(folder)) {
      return "'" + output + "' cannot be written: the folder '" + folder.string() +
             "' is write-protected. Change its permissions, or choose another place.";
    }
  }
  return {};
}

class BatchRun {
 public:
  BatchRun(const std::vector<BatchAsset>& assets, const RunBatchOptions& options)
      : assets_(assets),
        options_(options),
        results_(assets.size()),
        finished_shares_(assets.size(), 0) {
    concurrency_ = options.concurrent_bakes != 0 ? options.concurrent_bakes
                   : thread_count() > 1          ? 2
                                                 : 1;
    sources_.emplace(concurrency_);
    for (std::size_t i = 0; i < assets.size(); ++i) {
      results_[i].name = assets[i].name;
      total_weight_ += weight(i);
    }
  }

  std::vector<AssetResult> run() {
    if (concurrency_ <= 1 || assets_.size() <= 1) {
      run_next_assets();
    } else {
      std::vector<std::jthread> threads;
      for (unsigned i = 1; i < std::min<std::size_t>(concurrency_, assets_.size()); ++i) {
        threads.emplace_back([this] {
          obey_memory_limit();
          run_next_assets();
        });
      }
      run_next_assets();
    }
    if (callback_error_) std::rethrow_exception(callback_error_);
    return std::move(results_);
  }

 private:
  double weight(std::size_t i) const { return std::max(1e-3, assets_[i].expected_seconds); }

  bool interrupted() const { return options_.interrupted && options_.interrupted(); }

  void run_next_assets() {
    std::size_t i = 0;
    std::uint64_t bytes = 0;
    while (next_asset(i, bytes)) {
      results_[i] = run_asset(i);
      release_memory(bytes);
      try {
        report_result(i);
      } catch (...) {
        // A callback has thrown an exception, so that results can no longer be reported. The run ends.
        const std::lock_guard lock(mutex_);
        if (!callback_error_) callback_error_ = std::current_exception();
        next_index_ = assets_.size();
      }
    }
  }

  /// Waits until memory suffices for the next asset in addition to the running ones.
  /// \returns false if no asset is left
  bool next_asset(std::size_t& i, std::uint64_t& bytes) {
    std::unique_lock lock(mutex_);
    if (next_index_ == assets_.size() || interrupted()) return false;
    i = next_index_++;
    bytes = expected_bytes(assets_[i].job);
    // The free memory already excludes what running bakes have allocated, and their whole estimates are subtracted from
    // it. So this counts a part of their memory twice, and runs fewer bakes at once than memory would allow. A bake
    // that waits to run alone has priority.
    while (waiting_to_run_alone_ > 0 || (running_ > 0 && running_bytes_ + bytes > memory_left())) {
      bake_finished_.wait_for(lock, std::chrono::milliseconds(50));
      if (interrupted()) return false;
    }
    ++running_;
    running_bytes_ += bytes;
    return true;
  }

  void release_memory(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    --running_;
    running_bytes_ -= bytes;
    bake_finished_.notify_all();
  }

  /// True if an error may be due to a lack of memory, because several bakes ran at once.
  bool may_lack_memory(const AssetResult& result) const {
    return concurrency_ > 1 && result.state == AssetState::failed &&
           result.error_code == static_cast<int>(ErrorCode::internal) &&
           result.error_id != "timeout";
  }

  /// Repeats a bake while no other one runs, since estimates of memory may be too low.
  void retry_alone(std::size_t i, const Stopwatch& watch, AssetResult& result) {
    {
      std::unique_lock lock(mutex_);
      ++waiting_to_run_alone_;
      --running_;
      bake_finished_.notify_all();
      while (running_ > 0) bake_finished_.wait_for(lock, std::chrono::milliseconds(50));
      ++running_;
    }
    const unsigned attempts = result.attempts;
    result = {};
    result.name = assets_[i].name;
    result.attempts = attempts;
    try_asset(i, watch, result);
    const std::lock_guard lock(mutex_);
    --waiting_to_run_alone_;
    bake_finished_.notify_all();
  }

  void report_result(std::size_t i) {
    const std::lock_guard lock(report_mutex_);
    finished_shares_[i] = 1;
    if (options_.on_result) options_.on_result(assets_[i], results_[i]);
    show_progress({});
  }

  void show_progress(std::string_view stage) {
    if (!options_.on_progress) return;
    double completed = 0;
    for (std::size_t i = 0; i < finished_shares_.size(); ++i)
      completed += finished_shares_[i] * weight(i);
    options_.on_progress(completed / total_weight_, stage);
  }

  Device device() {
    const std::lock_guard lock(device_mutex_);
    if (!device_) {
      device_ = Device::open(options_.device);
      if (options_.cache != nullptr) options_.cache->set_device(device_->info());
    }
    return *device_;
  }

  AssetResult run_asset(std::size_t i) {
    const BatchAsset& asset = assets_[i];
    const Stopwatch watch;
    AssetResult result;
    for (unsigned attempt = 0; attempt <= asset.retries; ++attempt) {
      result = {};
      result.name = asset.name;
      result.attempts = attempt + 1;
      try_asset(i, watch, result);
      if (may_lack_memory(result) && !interrupted()) retry_alone(i, watch, result);
      // A bake with wrong options would fail again, so it is not retried.
      const bool is_retryable = result.state == AssetState::failed &&
                                result.error_code != static_cast<int>(ErrorCode::usage);
      if (!is_retryable || interrupted()) break;
    }
    const bool has_outputs = result.state == AssetState::baked ||
                             result.state == AssetState::unchanged ||
                             result.state == AssetState::restored;
    if (has_outputs && options_.check) run_checks(assets_[i], result);
    result.seconds = watch.total();
    return result;
  }

  /// Runs the checks of an asset, and sets its state to failed if one of them finds a problem.
  void run_checks(const BatchAsset& asset, AssetResult& result) const {
    // Checks read files with another InputLog, so that these do not count as inputs of bakes.
    InputLog no_log([](const fs::path&) { return std::string(); });
    const InputLogScope scope(&no_log);
    std::vector<std::string> problems;
    try {
      problems = options_.check(asset, result);
    } catch (const Error& error) {
      problems = {error.message().text(option_as_flag)};
    } catch (const std::exception& error) {
      problems = {error.what()};
    }
    if (problems.empty()) return;
    result.state = AssetState::failed;
    result.error_id = "check";
    result.error_code = 1;
    for (const std::string& problem : problems)
      result.error += (result.error.empty() ? "" : "; ") + problem;
    result.error += ".";
  }

  /// Computes the share of missed samples in a bake's report, over all texture sets.
  static double missed_share(const Json& report) {
    double missed = 0, samples = 0;
    const auto add = [&](const Json& texels) {
      if (!texels.is_object()) return;
      missed += texels.at("missed").number();
      samples += texels.at("samples").number();
    };
    const Json& sets = report.at("sets");
    if (sets.is_array() && !sets.empty()) {
      for (const Json& set : sets.elements()) add(set.at("texels"));
    } else {
      add(report.at("texels"));
    }
    return samples > 0 ? missed / samples : 0;
  }

  void try_asset(std::size_t i, const Stopwatch& watch, AssetResult& result) {
    const BatchAsset& asset = assets_[i];
    const auto fail = [&](int code, const char* id, const std::string& message) {
      result.state = AssetState::failed;
      result.error_code = code;
      result.error_id = id;
      result.error = message;
    };
    if (!asset.problem.empty()) {
      fail(static_cast<int>(ErrorCode::input), "input", asset.problem + ".");
      return;
    }
    try {
      bake(i, watch, result);
    } catch (const Error& error) {
      fail(static_cast<int>(error.code()), error.id(), error.message().text(option_as_flag));
    } catch (const std::bad_alloc&) {
      fail(static_cast<int>(ErrorCode::internal), "memory",
           "out of memory, or --memory-limit was reached: run fewer bakes at once, or raise the "
           "limit.");
    } catch (const std::exception& error) {
      fail(static_cast<int>(ErrorCode::internal), "internal", error.what());
    }
    if (result.state == AssetState::failed && interrupted()) result.state = AssetState::cancelled;
  }

  /// \param watch  stopwatch that runs since the asset's first attempt
  void bake(std::size_t i, const Stopwatch& watch, AssetResult& result) {
    const BatchAsset& asset = assets_[i];
    // Write-protected outputs are an error only if the asset must be baked; it may be unchanged.
    const std::string unwritable = unwritable_output(asset.job);
    const bool may_be_unchanged =
        options_.cache != nullptr && !options_.rebake && !options_.cache->inputs_of(asset).empty();
    if (!unwritable.empty() && !may_be_unchanged) throw Error(ErrorCode::output, unwritable);
    if (!asset.before.empty()) run_hook(asset, asset.before, "before", result);
    InputLog log([this](const fs::path& path) {
      return options_.cache == nullptr ? std::string() : BakeCache::identify(path);
    });
    const InputLogScope scope(&log);
    // Deletes outputs that were not moved to their destinations, even if an exception is thrown.
    struct Discard {
      const InputLog& log;
      ~Discard() { discard_outputs(log); }
    } const discard_on_exit{log};
    if (options_.cache != nullptr && take_from_cache(asset, log, unwritable, watch, result)) return;
    const double start = watch.total();
    bool is_timed_out = false;
    const auto progress = [&](double share, std::string_view stage) {
      {
        const std::lock_guard lock(report_mutex_);
        finished_shares_[i] = share;
        show_progress(asset.name + ": " + std::string(stage));
      }
      const double seconds = watch.total() - start;
      is_timed_out = is_timed_out || (asset.timeout > 0 && seconds > asset.timeout);
      return !is_timed_out && !interrupted();
    };
    RunHooks hooks;
    hooks.make_source = [this](const Device& device, const Mesh& mesh, RayTraversal traversal) {
      return sources_->get(device, mesh, traversal);
    };
    JobResult job_result = run_job([this] { return device(); }, asset.job, progress, hooks);
    if (job_result.cancelled) {
      if (!is_timed_out) {
        result.state = AssetState::cancelled;
        return;
      }
      throw Error(ErrorCode::internal,
                  formatted("the bake exceeded its timeout of %g seconds.", asset.timeout),
                  "timeout");
    }
    result.missed = missed_share(Json::parse(job_result.report));
    std::string changed;
    if (options_.cache != nullptr && job_result.failure.empty()) {
      changed = options_.cache->store_result(asset, log.inputs(), outputs_of(log), job_result.files,
                                             describe(job_result.warnings), result.missed);
    }
    if (!changed.empty()) {
      const Warning warning{"input-changed", changed + ": the next run bakes it again.", 1};
      job_result.warnings.push_back(warning);
      job_result.causes.push_back(warning);
    }
    place_outputs(asset.job, log);
    result.files = std::move(job_result.files);
    result.warnings = describe(job_result.warnings);
    result.causes = std::move(job_result.causes);
    result.report = std::move(job_result.report);
    result.state = AssetState::baked;
    if (!job_result.failure.empty()) {
      result.state = AssetState::failed;
      result.error = job_result.failure.text(option_as_flag);
      result.error_id = "limit";
      result.error_code = 1;
    }
    finish_asset(asset, watch, result);
  }

  /// Takes the asset's outputs from the cache, if possible.
  /// \param unwritable  the reason why outputs cannot be written; empty if they can
  /// \returns true if the asset need not be baked
  bool take_from_cache(const BatchAsset& asset, const InputLog& log, const std::string& unwritable,
                       const Stopwatch& watch, AssetResult& result) {
    device();  // Opens the device, whose class is part of the cache's keys
    if (options_.rebake) {
      result.reason = "--rebake was given";
      return false;
    }
    CacheDecision decision = options_.cache->decide(asset);
    result.reason = decision.reason;
    if (!unwritable.empty() && decision.kind != CacheDecision::Kind::unchanged)
      throw Error(ErrorCode::output, unwritable);
    if (decision.kind == CacheDecision::Kind::bake) return false;
    if (decision.kind == CacheDecision::Kind::restored) {
      if (!options_.cache->restore(asset, decision)) return false;
      place_outputs(asset.job, log);
    }
    result.files = decision.files;
    result.warnings = decision.warnings;
    result.missed = decision.missed;
    const bool unchanged = decision.kind == CacheDecision::Kind::unchanged;
    result.state = unchanged ? AssetState::unchanged : AssetState::restored;
    if (!unchanged) finish_asset(asset, watch, result);
    return true;
  }

  /// Runs the `after` hook and records the outputs, after they were moved to their destinations.
  /// \param watch  stopwatch that runs since the asset's first attempt; hooks get its seconds
  void finish_asset(const BatchAsset& asset, const Stopwatch& watch, AssetResult& result) {
    result.seconds = watch.total();
    if (!asset.after.empty()) run_hook(asset, asset.after, "after", result);
    if (options_.cache != nullptr) options_.cache->record_outputs(asset, !asset.after.empty());
  }

  /// Moves the files of a bake to their destinations: all of them, or none.
  void place_outputs(const Job& job, const InputLog& log) {
    const std::lock_guard lock(output_mutex_);
    for (const PendingOutput& output : outputs_of(log)) {
      // Two assets may still write the same file: stem "a" with map "b_normal", and stem "a_b" with map "normal".
      const std::string full_path = os::name_key(os::absolute_normal(output.destination));
      const auto [writer, added] = output_writers_.try_emplace(full_path, &job);
      if (!added && writer->second != &job) {
        throw Error(ErrorCode::usage, "'" + output.destination.string() +
                                          "' was already written by another bake of this run: give "
                                          "each bake a separate folder.");
      }
    }
    commit_outputs(log);
  }

  void run_hook(const BatchAsset& asset, const std::string& command, const char* name,
                const AssetResult& result) {
    std::string command_output;
    const auto is_space = [](char c) { return c == '\n' || c == '\r' || c == ' '; };
    const int status =
        options_.run_command
            ? options_.run_command(command, to_json(asset, result).dump() + "\n", command_output)
            : -1;
    if (status == 0) return;
    while (!command_output.empty() && is_space(command_output.back())) command_output.pop_back();
    throw Error(ErrorCode::input,
                std::string("the command in ") + name + " failed with exit code " +
                    std::to_string(status) + ": " + command +
                    (command_output.empty() ? "" : "\n" + command_output),
                "hook");
  }

  const std::vector<BatchAsset>& assets_;
  const RunBatchOptions& options_;
  std::vector<AssetResult> results_;
  std::mutex mutex_, report_mutex_, device_mutex_, output_mutex_;
  std::condition_variable bake_finished_;
  std::size_t next_index_ = 0;
  unsigned concurrency_ = 1, running_ = 0;
  unsigned waiting_to_run_alone_ = 0;  // Bakes in retry_alone()
  std::uint64_t running_bytes_ = 0;
  std::vector<double> finished_shares_;
  double total_weight_ = 0;
  std::optional<Device> device_;
  std::optional<SourceCache> sources_;
  std::map<std::string, const Job*> output_writers_;
  std::exception_ptr callback_error_;
};

}  // namespace

const char* name_of(AssetState state) {
  switch (state) {
    case AssetState::not_run:
      return "not run";
    case AssetState::baked:
      return "baked";
    case AssetState::unchanged:
      return "unchanged";
    case AssetState::restored:
      return "restored";
    case AssetState::failed:
      return "failed";
    case AssetState::cancelled:
      break;
  }
  return "cancelled";
}

std::vector<CacheDecision> plan_batch(const std::vector<BatchAsset>& assets, BakeCache& cache,
                                      const std::string& device) {
  cache.set_device(Device::open(device).info());
  std::vector<CacheDecision> decisions;
  for (const BatchAsset& asset : assets) decisions.push_back(cache.decide(asset));
  return decisions;
}

std::vector<AssetResult> run_batch(const std::vector<BatchAsset>& assets,
                                   const RunBatchOptions& options) {
  return BatchRun(assets, options).run();
}

Json to_json(const BatchAsset& asset, const AssetResult& result) {
  Json json = {{"asset", asset.name},
               {"state", name_of(result.state)},
               {"seconds", result.seconds},
               {"attempts", result.attempts},
               {"high", high_files(asset.job)},
               {"low", low_files(asset.job)},
               {"out", asset.job.out},
               {"files", result.files},
               {"warnings", result.warnings},
               {"missed", result.missed},
               {"reason", result.reason.empty() ? Json() : Json(result.reason)},
               {"error", Json()}};
  if (!result.error.empty()) {
    json["error"] = {
        {"message", result.error}, {"id", result.error_id}, {"code", result.error_code}};
  }
  return json;
}

}  // namespace kiln
