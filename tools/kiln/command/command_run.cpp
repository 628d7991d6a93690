// `kiln run`: runs the bakes of a job file, and prints their results.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "arguments/command_options.h"
#include "base/counted.h"
#include "base/file.h"
#include "base/stopwatch.h"
#include "batch/assets.h"
#include "batch/bake_cache.h"
#include "batch/checks.h"
#include "batch/job_file.h"
#include "batch/path_pattern.h"
#include "batch/report.h"
#include "batch/runner.h"
#include "command/http_store.h"
#include "command/run_page.h"
#include "command/run_watch.h"
#include "commands.h"
#include "interrupt.h"
#include "job/files.h"
#include "job/job_options.h"
#include "kiln/files.h"
#include "kiln/options.h"
#include "kiln/version.h"
#include "options/near_words.h"
#include "picture/plot.h"
#include "program.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

struct RunArguments {
  std::string file, profile, explain, device, json, cache,
      cache_limit = "10G", depfile, depfile_target, junit, hashes, check_hashes, shard, report,
      baseline;
  std::vector<std::string> accept, merge;
  std::vector<std::string> only;
  std::uint32_t concurrent_bakes = 0;
  bool check = false, list = false, quiet = false, plan = false, no_cache = false, rebake = false;
  bool watch = false;
  bool allow_outside = false, allow_own_maps = false, allow_hooks = false;
  OptionLayer options{"command line", {}};  ///< Options of kiln bake that were given
};

std::string words_text(const OptionWords& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

int explain(const Batch& batch, const std::string& name) {
  const PathPattern pattern(name);
  std::vector<std::string> names;
  bool found = false;
  for (const BatchAsset& asset : batch.assets) {
    names.push_back(asset.name);
    if (asset.name != name && !pattern.selects_asset(asset.name)) continue;
    found = true;
    print_line(stdout, asset.name);
    std::size_t max_text_width = 0;
    for (const Setting& setting : asset.settings)
      max_text_width = std::max(max_text_width, setting.key.size());
    for (const Setting& setting : asset.settings) {
      const bool has_place = !setting.origin.file.empty();
      print_line(stdout, "  " + setting.key +
                             std::string(max_text_width - setting.key.size(), ' ') + " = " +
                             words_text(setting.words) + "  (" + setting.origin.layer +
                             (has_place ? ", " + setting.origin.place() : "") + ")");
    }
    if (!asset.problem.empty()) print_line(stdout, "  cannot be baked: " + asset.problem);
  }
  if (found) return 0;
  const std::string suggestion = nearest_word(name, names);
  fail_usage("--explain '" + name + "' is not the name of an asset" +
             (suggestion.empty() ? ": --list shows them." : "; did you mean " + suggestion + "?"));
}

/// The line that --list or --plan prints about an asset.
struct AssetLine {
  std::string text;
  Json object;
};

/// Prints a line per asset and a last one for all. With --json, assets are JSON objects: lines on standard output for
/// "-", else the array `assets` of a file.
void print_assets(const RunArguments& arguments, const std::vector<AssetLine>& assets,
                  const std::string& last, Console& console) {
  if (arguments.json.empty()) {
    for (const AssetLine& asset : assets) print_line(stdout, asset.text);
    print_line(stdout, last);
    return;
  }
  if (arguments.json == "-") {
    for (const AssetLine& asset : assets)
      print_line(stdout, asset.object.with_texts(escape_bytes).dump());
  } else {
    Json all = Json::array();
    for (const AssetLine& asset : assets) all.push_back(asset.object);
    prepare_parent(arguments.json);
    save_text(arguments.json,
              to_text(Json{{"job", arguments.file}, {"assets", all}}.with_texts(escape_bytes)));
  }
  console.line(last);
}

Json text_or_null(const std::string& text) { return text.empty() ? Json() : Json(text); }

int list(const RunArguments& arguments, const Batch& batch, Console& console) {
  std::size_t max_text_width = 0;
  double seconds = 0;
  for (const BatchAsset& asset : batch.assets)
    max_text_width = std::max(max_text_width, asset.name.size());
  std::vector<AssetLine> lines;
  for (const BatchAsset& asset : batch.assets) {
    seconds += asset.expected_seconds;
    lines.push_back({asset.name + std::string(max_text_width - asset.name.size(), ' ') +
                         (asset.problem.empty()
                              ? formatted("  %7.2f s  ", asset.expected_seconds) + asset.job.out
                              : "  cannot be baked: " + asset.problem),
                     {{"asset", asset.name},
                      {"seconds", asset.expected_seconds},
                      {"out", asset.job.out},
                      {"problem", text_or_null(asset.problem)}}});
  }
  print_assets(
      arguments, lines,
      formatted("%s, about %.3g s in all", counted(batch.assets.size(), "asset").c_str(), seconds),
      console);
  return 0;
}

ReportHead report_head_of(const RunArguments& arguments, double seconds) {
  return {arguments.file, arguments.profile, arguments.shard, seconds};
}

/// Adds the differences to a former report to a report, and prints them.
void compare(const RunArguments& arguments, const Json& former, Json& report, Console& console) {
  // Hashes of maps are only computed for report pages.
  const auto has_maps = [](const Json& of) {
    const std::vector<Json>& assets = of.at("assets").elements();
    return std::any_of(assets.begin(), assets.end(),
                       [](const Json& asset) { return asset.at("maps").is_array(); });
  };
  if (!has_maps(former) || !has_maps(report)) {
    console.warning(
        "--baseline: " + (has_maps(former) ? "this run's report" : "'" + arguments.baseline + "'") +
        " has no hashes of maps, so changed pixels are not seen: write both reports "
        "with --report FILE.");
  }
  add_baseline(report, former);
  report["baseline"] = arguments.baseline;
  std::vector<const Json*> changed;
  for (const Json& asset : report.at("assets").elements()) {
    if (asset.at("baseline.state").text() != "same") changed.push_back(&asset);
  }
  std::stable_sort(changed.begin(), changed.end(), [](const Json* a, const Json* b) {
    return a->at("baseline.worse").number() > b->at("baseline.worse").number();
  });
  console.line("beside '" + arguments.baseline + "': " + std::to_string(changed.size()) + " of " +
               counted(report.at("assets").size(), "asset") + " changed, " +
               std::to_string(report.at("gone").size()) + " gone");
  constexpr std::size_t kMaxLines = 10;
  for (std::size_t i = 0; i < std::min(kMaxLines, changed.size()); ++i) {
    std::string changes;
    for (const Json& one : changed[i]->at("baseline.what").elements())
      changes += (changes.empty() ? "" : "; ") + one.text();
    console.line("  " + changed[i]->at("asset").text() + ": " + changes);
  }
}

/// Writes all requested reports.
void save_reports(const RunArguments& arguments, const Json& report) {
  if (!arguments.json.empty() && arguments.json != "-")
    save_report(arguments.json, remove_picture_bytes(report));
  if (!arguments.report.empty()) save_page(arguments.report, report);
  if (!arguments.junit.empty()) {
    save_text(arguments.junit, format_junit(std::filesystem::path(arguments.file).stem().string(),
                                            report.at("assets")));
  }
}

/// Merges the reports of a run's shards.
int merge(const RunArguments& arguments, Console& console) {
  refuse_if(arguments.json.empty() && arguments.report.empty() && arguments.junit.empty(),
            "--merge needs an output: give --json FILE, --report FILE or --junit FILE.");
  std::vector<Json> reports;
  for (const std::string& file : arguments.merge) {
    reports.push_back(read_report(file, "--merge '" + file + "'"));
    const std::filesystem::path job = reports.back().at("job").text();
    refuse_if(job.filename() != std::filesystem::path(arguments.file).filename(),
              "--merge '" + file + "' is of the job file '" + job.string() + "', not of '" +
                  arguments.file + "': give reports of the same run.");
  }
  Json report = merge_reports(reports, arguments.merge);
  if (!arguments.baseline.empty()) {
    compare(arguments, read_report(arguments.baseline, "--baseline '" + arguments.baseline + "'"),
            report, console);
  }
  std::size_t failed = 0;
  for (const Json& asset : report.at("assets").elements()) {
    if (arguments.json == "-") print_line(stdout, asset.with_texts(escape_bytes).dump());
    const std::string& state = asset.at("state").text();
    if (state != "failed" && state != "cancelled" && state != "not run") continue;
    ++failed;
    print_line(stderr,
               "kiln: " + asset.at("asset").text() + ": " +
                   (asset.at("error").is_null() ? state : asset.at("error.message").text()));
  }
  save_reports(arguments, report);
  console.line(counted(report.at("assets").size(), "asset") + " of " +
               counted(reports.size(), "report") + ": " + std::to_string(failed) + " failed");
  return failed == 0 ? 0 : 1;
}

/// Runs a shell command in the job file's folder. \returns its exit code
int run_shell(const JobFile& file, const std::string& command, const std::string& input,
              std::string& said) {
  constexpr double kLimitSeconds = 3600;
  if (!RunningProgram::is_supported()) {
    said =
        "Kiln runs no commands on this system: leave it out of the job file, or run the job on "
        "Linux";
    return -1;
  }
  std::optional<RunningProgram> shell =
      RunningProgram::start({"/bin/sh", "-c", command}, file.folder.empty() ? "." : file.folder);
  if (!shell) {
    said = "there is no /bin/sh";
    return -1;
  }
  shell->begin(input, kLimitSeconds, interrupted);
  const ProgramResult result = shell->finish();
  said = result.output + result.errors;
  return result.exit_code;
}

/// Collects warnings of the cache server from any thread, to print them at the end of a run.
class LateWarnings {
 public:
  void add(const std::string& text) {
    const std::lock_guard lock(mutex_);
    texts_.push_back(text);
  }
  void print(Console& console) {
    const std::lock_guard lock(mutex_);
    for (const std::string& text : texts_) console.warning(text);
    texts_.clear();
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> texts_;
};

/// Returns the folder of the cache; empty if the cache is a server.
std::filesystem::path cache_folder(const RunArguments& arguments, const JobFile& file) {
  if (arguments.cache.empty()) return file.folder / ".kiln";
  return is_cache_server(arguments.cache) ? "" : arguments.cache;
}

/// Opens the cache; null with --no-cache.
std::unique_ptr<BakeCache> open_cache(const RunArguments& arguments, const JobFile& file,
                                      LateWarnings& late) {
  refuse_if(arguments.no_cache && !arguments.cache.empty(),
            "--no-cache and --cache exclude each other: leave one out.");
  if (arguments.no_cache) return nullptr;
  const std::filesystem::path folder = cache_folder(arguments, file);
  std::unique_ptr<CacheStore> store;
  if (folder.empty()) {
    store =
        open_cache_server(arguments.cache, [&late](const std::string& text) { late.add(text); });
  } else {
    store = std::make_unique<FolderStore>(folder);
  }
  // Records are separate for each job file, because two files of a folder may have assets of the same name.
  const std::filesystem::path records = file.folder / ".kiln" / "records" / file.path.filename();
  return std::make_unique<BakeCache>(file.folder, records, std::move(store));
}

int plan(const RunArguments& arguments, const Batch& batch, BakeCache& cache, Console& console) {
  const std::vector<CacheDecision> decisions = plan_batch(batch.assets, cache, arguments.device);
  std::vector<AssetLine> lines;
  std::map<CacheDecision::Kind, std::size_t> counts;
  for (std::size_t i = 0; i < decisions.size(); ++i) {
    const CacheDecision& decision = decisions[i];
    ++counts[decision.kind];
    const char* const action = decision.kind == CacheDecision::Kind::unchanged  ? "unchanged"
                               : decision.kind == CacheDecision::Kind::restored ? "from the cache"
                                                                                : "bake";
    lines.push_back({batch.assets[i].name + ": " + action +
                         (decision.reason.empty() ? "" : ": " + decision.reason),
                     {{"asset", batch.assets[i].name},
                      {"action", action},
                      {"reason", text_or_null(decision.reason)},
                      {"seconds", batch.assets[i].expected_seconds},
                      {"out", batch.assets[i].job.out}}});
  }
  print_assets(
      arguments, lines,
      formatted("%zu to bake, %zu from the cache, %zu unchanged", counts[CacheDecision::Kind::bake],
                counts[CacheDecision::Kind::restored], counts[CacheDecision::Kind::unchanged]),
      console);
  return 0;
}

/// Escapes a path for makefiles.
std::string make_path(const std::string& path) {
  std::string text;
  for (const char c : path) {
    if (c == ' ' || c == '#' || c == '\\' || c == ':') text += '\\';
    if (c == '$') text += '$';
    text += c;
  }
  return text;
}

/// Writes a depfile for make and Ninja: all outputs, and all files that they depend on.
void save_depfile(const RunArguments& arguments, const Batch& batch,
                  const std::vector<AssetResult>& results, BakeCache& cache) {
  std::set<std::string> inputs = {os::absolute_normal(arguments.file).string()};
  std::string text;
  for (std::size_t i = 0; i < results.size(); ++i) {
    for (const std::string& file : results[i].files) {
      text += (text.empty() ? "" : " \\\n  ") + make_path(os::absolute_normal(file).string());
    }
    for (const std::string& input : cache.inputs_of(batch.assets[i])) inputs.insert(input);
    for (const Setting& setting : batch.assets[i].settings) {
      if (setting.origin.layer == "sidecar")
        inputs.insert(os::absolute_normal(setting.origin.file).string());
    }
  }
  if (!arguments.depfile_target.empty()) text = make_path(arguments.depfile_target);
  text += ":";
  for (const std::string& input : inputs) text += " \\\n  " + make_path(input);
  save_text(arguments.depfile, text + "\n");
}

/// Removes all assets outside a shard such as "2/8" (the second of eight). \throws Error(usage)
void keep_assets_of_shard(const std::string& shard, Batch& batch) {
  const std::size_t slash = shard.find('/');
  double part = 0, count = 0;
  const bool is_valid = slash != std::string::npos && read_number(shard.substr(0, slash), part) &&
                        read_number(shard.substr(slash + 1), count) && part >= 1 && part <= count &&
                        count <= 10000 && part == std::floor(part) && count == std::floor(count);
  refuse_if(!is_valid,
            "--shard '" + shard + "' is not a shard: give I/N, such as 1/8 for the first of 8.");
  const std::vector<std::size_t> shards =
      assign_shards(batch.assets, static_cast<std::size_t>(count));
  std::vector<BatchAsset> some;
  for (std::size_t i = 0; i < shards.size(); ++i) {
    if (shards[i] + 1 == static_cast<std::size_t>(part)) some.push_back(std::move(batch.assets[i]));
  }
  batch.assets = std::move(some);
}

/// Applies the checks of --check: golden maps, limits and hashes.
class ResultChecks {
 public:
  ResultChecks(const RunArguments& arguments, const JobFile& file)
      : arguments_(arguments), file_(file) {
    for (const std::string& accept : arguments.accept) accept_.emplace_back(accept);
    refuse_if(!accept_.empty() && file.check.golden.empty(),
              "--accept needs golden maps, but the job file has no [check] with golden.");
    if (!arguments.check_hashes.empty()) {
      constexpr std::size_t kMostBytes = std::size_t{64} << 20;
      wanted_ = parse_hashes(read_small_file(arguments.check_hashes, kMostBytes,
                                             "--check-hashes '" + arguments.check_hashes + "'"),
                             arguments.check_hashes);
    }
  }

  /// Checks one asset. It may be called concurrently.
  std::vector<std::string> check(const BatchAsset& asset, const AssetResult& result) {
    if (!arguments_.hashes.empty() || !arguments_.check_hashes.empty()) {
      std::map<std::string, std::string> hashes;
      const std::filesystem::path base =
          os::absolute_normal(file_.folder.empty() ? "." : file_.folder);
      for (const std::string& output : result.files) {
        hashes[os::absolute_normal(output).lexically_proximate(base).generic_string()] =
            pixel_hash(output);
      }
      const std::lock_guard lock(mutex_);
      hashes_.merge(hashes);
    }
    const bool accepted =
        std::any_of(accept_.begin(), accept_.end(),
                    [&](const PathPattern& pattern) { return pattern.selects_asset(asset.name); });
    if (!accepted) return check_asset(file_, result);
    const std::lock_guard lock(mutex_);
    for (std::string& golden : accept_asset(file_, result)) golden_.push_back(std::move(golden));
    return {};
  }

  /// Completes the checks after all assets.
  /// \param whole  true if no asset was skipped
  /// \returns the problems
  std::vector<std::string> finish(Console& console, const std::vector<AssetResult>& results,
                                  bool whole) {
    for (const std::string& golden : golden_) console.line("accepted: " + golden);
    if (!arguments_.hashes.empty()) save_text(arguments_.hashes, format_hashes(hashes_));
    std::vector<std::string> problems;
    if (!arguments_.check_hashes.empty()) {
      // Skipped assets keep their former hashes.
      if (!whole)
        std::erase_if(wanted_, [&](const auto& entry) { return hashes_.count(entry.first) == 0; });
      problems = compare_hashes(wanted_, hashes_);
    }
    if (whole && accept_.empty() && !file_.check.golden.empty()) {
      for (const std::string& golden : golden_without_outputs(file_, results)) {
        problems.push_back("'" + golden +
                           "' is a golden map, but no map with its name was written");
      }
    }
    return problems;
  }

 private:
  const RunArguments& arguments_;
  const JobFile& file_;
  std::vector<PathPattern> accept_;
  std::mutex mutex_;
  std::map<std::string, std::string> hashes_, wanted_;
  std::vector<std::string> golden_;
};

ExpandOptions expand_options(const RunArguments& arguments) {
  ExpandOptions expand;
  expand.allow_outside = arguments.allow_outside;
  expand.allow_own_maps = arguments.allow_own_maps;
  expand.allow_hooks = arguments.allow_hooks;
  expand.selected_names = arguments.only;
  expand.command_line = arguments.options;
  return expand;
}

/// Describes the outputs of a run as a text, or states the error in the job file. A different text starts a new run.
std::string plan_text(const RunArguments& arguments) {
  try {
    const JobFile file = read_job_file(arguments.file, arguments.profile);
    std::string text;
    for (const BatchAsset& asset : expand_job_file(file, expand_options(arguments)).assets)
      text += asset.name + "\n" + to_json(asset.job) + "\n" + asset.problem + "\n";
    return text;
  } catch (const Error& error) {
    return error.what();
  }
}

/// All known files that a run depends on.
std::set<std::string> watched_files(const RunArguments& arguments) {
  std::set<std::string> files = {arguments.file};
  try {
    const JobFile file = read_job_file(arguments.file, arguments.profile);
    LateWarnings late;
    RunArguments local = arguments;
    local.cache = "";  // only the records are read
    const std::unique_ptr<BakeCache> cache = open_cache(local, file, late);
    for (const BatchAsset& asset : expand_job_file(file, expand_options(arguments)).assets) {
      for (const std::vector<std::string>& some :
           {high_files(asset.job), low_files(asset.job), cache->inputs_of(asset)}) {
        files.insert(some.begin(), some.end());
      }
      for (const Setting& setting : asset.settings) {
        if (!setting.origin.file.empty()) files.insert(setting.origin.file);
      }
    }
  } catch (const Error&) {
    // The run itself reports this error. Until it is corrected, only the job file is watched.
  }
  return files;
}

int run_job_file(const RunArguments& arguments) {
  Console console(arguments.quiet, arguments.json);
  const Stopwatch watch;
  refuse_if(!arguments.baseline.empty() && arguments.report.empty() &&
                (arguments.json.empty() || arguments.json == "-"),
            "--baseline needs a report: add --report FILE or --json FILE.");
  refuse_if(!arguments.json.empty() && (arguments.check || !arguments.explain.empty()),
            "--check and --explain print text: leave --json out, or give --plan or --list.");
  check_paths({arguments.file}, {arguments.json, arguments.report, arguments.junit,
                                 arguments.hashes, arguments.depfile});
  if (arguments.watch) {
    refuse_if(
        arguments.plan || arguments.list || arguments.check || arguments.rebake ||
            arguments.no_cache || !arguments.explain.empty() || !arguments.merge.empty() ||
            !arguments.accept.empty(),
        "--watch repeats ordinary runs: leave out --plan, --list, --check, --explain, --merge, "
        "--accept, --rebake and --no-cache.");
    return run_watched([&] { return watched_files(arguments); },
                       [&] { return plan_text(arguments); }, console);
  }
  if (!arguments.merge.empty()) return merge(arguments, console);
  const JobFile file = read_job_file(arguments.file, arguments.profile);
  Batch batch = expand_job_file(file, expand_options(arguments));
  if (!arguments.shard.empty()) keep_assets_of_shard(arguments.shard, batch);
  for (const Warning& warning : batch.warnings) console.warning(warning.message);
  if (!arguments.explain.empty()) return explain(batch, arguments.explain);
  if (arguments.list) return list(arguments, batch, console);
  if (arguments.check) {
    std::size_t problems = 0;
    for (const BatchAsset& asset : batch.assets) {
      if (asset.problem.empty()) continue;
      ++problems;
      print_line(stderr, "kiln: " + asset.name + ": " + asset.problem + ".");
    }
    console.line(problems == 0 ? counted(batch.assets.size(), "asset") + ": the job file is good"
                               : std::to_string(problems) + " of " +
                                     counted(batch.assets.size(), "asset") + " cannot be baked");
    return problems == 0 ? 0 : static_cast<int>(ErrorCode::input);
  }
  LateWarnings late;
  const std::unique_ptr<BakeCache> cache = open_cache(arguments, file, late);
  refuse_if(cache == nullptr && (arguments.plan || arguments.rebake || !arguments.depfile.empty()),
            "--plan, --rebake and --depfile need the cache: leave --no-cache out.");
  refuse_if(arguments.depfile.empty() && !arguments.depfile_target.empty(),
            "--depfile-target needs --depfile FILE.");
  const std::uint64_t limit = parse_memory("--cache-limit", arguments.cache_limit);
  if (arguments.plan) {
    const int code = plan(arguments, batch, *cache, console);
    late.print(console);
    return code;
  }
  // The destinations of outputs and the former report are checked before the bakes.
  for (const std::string* const output : {&arguments.json, &arguments.report, &arguments.junit,
                                          &arguments.hashes, &arguments.depfile}) {
    if (*output != "-") prepare_parent(*output);
  }
  Json former;
  if (!arguments.baseline.empty())
    former = read_report(arguments.baseline, "--baseline '" + arguments.baseline + "'");
  RunBatchOptions options;
  options.device = arguments.device;
  options.cache = cache.get();
  options.rebake = arguments.rebake;
  ResultChecks result_checks(arguments, file);
  options.check = [&](const BatchAsset& asset, const AssetResult& result) {
    return result_checks.check(asset, result);
  };
  options.concurrent_bakes = arguments.concurrent_bakes;
  options.interrupted = interrupted;
  options.run_command = [&file](const std::string& hook, const std::string& input,
                                std::string& said) { return run_shell(file, hook, input, said); };
  options.on_progress = [&](double share, std::string_view stage) {
    console.progress(share, time_left(share, watch.total()) + std::string(stage));
  };
  std::size_t finished = 0;
  options.on_result = [&](const BatchAsset& asset, const AssetResult& result) {
    ++finished;
    for (const Warning& warning : result.causes)
      console.warning(asset.name + ": " + warning.message);
    const std::string state = result.state == AssetState::failed ? "FAILED" : name_of(result.state);
    // Unchanged assets are only counted, in the last line.
    if (result.state != AssetState::unchanged)
      console.line(formatted("[%zu/%zu] ", finished, batch.assets.size()) + asset.name + ": " +
                   state + formatted(" in %.2f s", result.seconds) +
                   (!result.error.empty()   ? ": " + result.error
                    : result.reason.empty() ? ""
                                            : " (" + result.reason + ")"));
    if (arguments.json == "-") {
      print_line(stdout, to_json(asset, result).with_texts(escape_bytes).dump());
    }
  };
  const std::vector<AssetResult> results = run_batch(batch.assets, options);
  if (interrupted()) {
    const auto ready = std::count_if(results.begin(), results.end(), [](const AssetResult& result) {
      return result.state == AssetState::baked;
    });
    print_line(stderr, std::to_string(ready) + " of " + counted(results.size(), "asset") +
                           " were baked before the interrupt.");
    return kExitCancelled;
  }
  const double seconds = watch.total();
  if (cache != nullptr) {
    const bool has_written =
        std::any_of(results.begin(), results.end(),
                    [](const AssetResult& result) { return result.state == AssetState::baked; });
    // A cache server limits its size itself.
    const std::filesystem::path folder = cache_folder(arguments, file);
    if (has_written && !folder.empty()) FolderStore(folder).prune(limit);
    late.print(console);
    if (!arguments.depfile.empty()) save_depfile(arguments, batch, results, *cache);
  }
  const bool is_whole_run =
      arguments.only.empty() && arguments.shard.empty() &&
      std::none_of(results.begin(), results.end(), [](const AssetResult& result) {
        return result.state == AssetState::failed && result.files.empty();
      });
  const std::vector<std::string> problems = result_checks.finish(console, results, is_whole_run);
  std::vector<const AssetResult*> failed;
  for (const AssetResult& result : results) {
    if (result.state == AssetState::failed) failed.push_back(&result);
  }
  std::map<AssetState, std::size_t> counts;
  for (const AssetResult& result : results) ++counts[result.state];
  const auto print_summary = [&] {
    console.line(formatted("%s in %.2f s: %zu baked, %zu from the cache, %zu unchanged, %zu failed",
                           counted(results.size(), "asset").c_str(), seconds,
                           counts[AssetState::baked], counts[AssetState::restored],
                           counts[AssetState::unchanged], counts[AssetState::failed]));
    for (const AssetResult* result : failed) {
      print_line(stderr, "kiln: " + result->name + ": " + result->error);
    }
    for (const std::string& problem : problems) print_line(stderr, "kiln: " + problem + ".");
  };
  if (!arguments.json.empty() || !arguments.report.empty() || !arguments.junit.empty()) {
    Json report = report_of(report_head_of(arguments, seconds), batch, results);
    if (!arguments.report.empty() &&
        !add_pictures(
            report, batch.assets, results, [&] { return Device::open(arguments.device); },
            cache.get(), console)) {
      return kExitCancelled;
    }
    if (!arguments.baseline.empty()) compare(arguments, former, report, console);
    try {
      save_reports(arguments, report);
    } catch (...) {
      // If the disk is full, both assets and reports fail; the failed assets are printed even then
      print_summary();
      throw;
    }
  }
  print_summary();
  return failed.empty() && problems.empty() ? 0 : 1;
}

/// Adds the options of `kiln bake`, which override those in the job file.
void add_bake_options(Command& command, RunArguments& arguments) {
  static const std::set<std::string> own_flags = {
      "HIGH", "LOW", "--high", "--low", "--json", "--quiet", "--device", "--allow-outside"};
  for (const OptionRow& row : bake_rows()) {
    if (own_flags.count(row.flag) != 0) continue;
    const OptionValue& value = row.value;
    const Option::ValueCallback take = [&row,
                                        layer = &arguments.options](const OptionWords& words) {
      Job job;  // Unknown flags are explained as in kiln bake
      row.value.set(&job, row.flag, words);
      layer->settings.push_back({option_key(row), words, false, {"command line", "", 0}, ""});
    };
    Option* const option =
        value.type.starts_with("flag")
            ? command.add_flag(row.flag, take, row.help)
            : command.add_option(row.flag, Option::ValueCallback(take), row.help);
    option->type_name(value.words)
        ->group("Options of kiln bake, which override those in the file")
        ->choices(value.choices);
    if (value.repeats) option->repeats();
    if (value.delimiter != 0) option->delimiter(value.delimiter);
  }
}

}  // namespace

Run add_run(Command& app) {
  Command* command = app.add_command("run", "Run all bakes of a job file in one process");
  auto arguments = std::make_shared<RunArguments>();
#define AT(member) KILN_MEMBER(RunArguments, member)
  const OptionRow rows[] = {
      {.flag = "JOB",
       .value = text(AT(file), "JOB.toml"),
       .help = "The job file (TOML)",
       .required = true},
      {.flag = "--profile",
       .value = text(AT(profile), "NAME"),
       .help = "Also use the options of [profile.NAME], which override [defaults]"},
      {.flag = "--only",
       .value = texts(AT(only)),
       .help = "Only bake assets whose names match the pattern, such as 'props/*'; may be given "
               "several times"},
      {.flag = "--check",
       .value = toggle(AT(check)),
       .help = "Check the job file and its inputs, without baking"},
      {.flag = "--list",
       .value = toggle(AT(list)),
       .help = "Print the assets with the expected seconds of each, without baking; with --json as "
               "JSON"},
      {.flag = "--explain",
       .value = text(AT(explain), "NAME"),
       .help =
           "Print the options of an asset, or of all that match a pattern, and the origin of each"},
      {.flag = "--plan",
       .value = toggle(AT(plan)),
       .help = "Print the assets that would be baked and why, without baking; with --json as JSON"},
      {.flag = "--watch",
       .value = toggle(AT(watch)),
       .help = "After the run, repeat it whenever a file that it depends on changes, until Ctrl-C"},
      {.flag = "--cache",
       .value = text(AT(cache), "DIR|URL"),
       .help =
           "Keep results in this folder, which may be shared, or on a server that takes PUT and "
           "GET, http://HOST/FOLDER (default: .kiln beside the job file)"},
      {.flag = "--no-cache",
       .value = toggle(AT(no_cache)),
       .help = "Bake all assets, and store no results"},
      {.flag = "--rebake",
       .value = toggle(AT(rebake)),
       .help = "Bake all assets, and store the results"},
      {.flag = "--cache-limit",
       .value = text(AT(cache_limit), "SIZE"),
       .help = "Largest size of the cache, such as 4G; the least recently used results are removed "
               "first"},
      {.flag = "--depfile",
       .value = text(AT(depfile), "FILE"),
       .help = "Write the dependencies of all outputs as a depfile for Make and Ninja"},
      {.flag = "--depfile-target",
       .value = text(AT(depfile_target), "TARGET"),
       .help = "Target of --depfile, such as a file that the rule touches after the run (default: "
               "all outputs)"},
      {.flag = "--accept",
       .value = texts(AT(accept)),
       .help = "Copy the outputs of assets whose names match the pattern to the golden maps of "
               "[check]; may be given several times"},
      {.flag = "--junit",
       .value = text(AT(junit), "FILE"),
       .help = "Write the results as JUnit XML"},
      {.flag = "--report",
       .value = text(AT(report), "FILE.html"),
       .help =
           "Write a self-contained page with pictures, maps, figures and warnings of each asset"},
      {.flag = "--baseline",
       .value = text(AT(baseline), "FORMER"),
       .help = "State in reports the changes since a former report, a file of --json or --report"},
      {.flag = "--merge",
       .value = texts(AT(merge)),
       .help = "Merge the reports of all shards (files of --json or --report), without baking; "
               "given once per file"},
      {.flag = "--hashes",
       .value = text(AT(hashes), "FILE"),
       .help = "Write a hash of the pixels of every map, to compare two machines"},
      {.flag = "--check-hashes",
       .value = text(AT(check_hashes), "FILE"),
       .help = "Compare with a file of --hashes; exit code 1 if the pixels of a map differ"},
      {.flag = "--shard",
       .value = text(AT(shard), "I/N"),
       .help = "Bake the I-th of N shards with about equal times, 1/N to N/N; all machines choose "
               "the same shards"},
      {.flag = "--at-once",
       .value = integer(AT(concurrent_bakes), 1, 64).or_unset(),
       .help = "Number of concurrent bakes (default: 2, or fewer if memory is short)"},
      {.flag = "--allow-outside",
       .value = toggle(AT(allow_outside)),
       .help = "Allow outputs outside the job file's folder"},
      {.flag = "--allow-own-maps",
       .value = toggle(AT(allow_own_maps)),
       .help = "Allow own maps in OpenCL C, which are code that runs with your rights"},
      {.flag = "--allow-hooks",
       .value = toggle(AT(allow_hooks)),
       .help = "Allow hooks (before, after), which are commands that run with your rights"},
      device_row<RunArguments>(""),
      {.flag = "--json",
       .value = text(AT(json)),
       .help =
           "Write a report to this file; - prints one line of JSON per asset on standard output"},
      {.flag = "--quiet",
       .value = toggle(AT(quiet)),
       .help = "Print neither progress nor results; warnings and errors are still printed"},
  };
#undef AT
  add_options(*command, rows, arguments.get());
  add_bake_options(*command, *arguments);
  command->add_text_flag("--print-schema", job_file_schema,
                         "A JSON Schema of job files, for editors");
  command->add_text_flag("--print-report-schema", report_schema,
                         "A JSON Schema of the reports of --json");
  return [arguments] { return run_job_file(*arguments); };
}

}  // namespace kiln::cli
