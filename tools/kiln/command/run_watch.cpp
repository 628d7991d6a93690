#include "command/run_watch.h"

#include <chrono>
#include <map>
#include <thread>
#include <vector>

#include "base/counted.h"
#include "base/file.h"
#include "base/process.h"
#include "interrupt.h"
#include "kiln/error.h"

namespace kiln::cli {
namespace {

/// Minimum pause between two checks. A pause lasts at least as long as a check, so that checks use at most half a core.
constexpr std::chrono::milliseconds kMinPause(100);
/// Time without a change after which a file counts as completely saved.
constexpr std::chrono::milliseconds kSettleTime(60);

/// Returns the size, the times and the inode number of a file as text; empty if there is no file.
std::string file_state(const std::string& path) {
  const auto facts = os::query_file(std::filesystem::path(path));
  if (!facts) return {};
  return std::to_string(facts->bytes) + ":" + std::to_string(facts->modified_ns) + ":" +
         std::to_string(facts->changed_ns) + ":" + std::to_string(facts->id.file);
}

struct Observation {
  std::map<std::string, std::string> state_by_file;
  std::string plan;
  bool operator==(const Observation&) const = default;
};

/// Returns the arguments of this program without --watch.
std::vector<std::string> words_without_watch() {
  std::vector<std::string> words = os::own_arguments();
  std::erase(words, "--watch");
  if (words.empty()) {
    throw Error(ErrorCode::internal,
                "--watch needs /proc/self/cmdline, which does not exist: run without --watch.");
  }
  return words;
}

/// Runs this program again as a child process, and waits for it.
void run_again(const std::vector<std::string>& words) {
  if (os::run_own_program(words, interrupted)) return;
  throw Error(ErrorCode::internal,
              "--watch cannot start a process: end some other processes, and run again.");
}

}  // namespace

int run_watched(const std::function<std::set<std::string>()>& files,
                const std::function<std::string()>& plan, Console& console) {
  const std::vector<std::string> words = words_without_watch();
  std::set<std::string> watched = files();
  const auto observe_files = [&] {
    Observation observation;
    for (const std::string& file : watched) observation.state_by_file[file] = file_state(file);
    observation.plan = plan();
    return observation;
  };
  for (;;) {
    const Observation state_before = observe_files();
    run_again(words);
    if (interrupted()) return kExitCancelled;
    watched = files();
    Observation baseline = observe_files();
    // Files that were saved during the run count as changed. Files that only the run found get their current state.
    for (const auto& [file, state] : state_before.state_by_file) {
      if (baseline.state_by_file.count(file) != 0) baseline.state_by_file[file] = state;
    }
    baseline.plan = state_before.plan;
    console.line("watching " + counted(watched.size(), "file") + "; press Ctrl-C to end");
    for (;;) {
      const auto start = std::chrono::steady_clock::now();
      if (observe_files() != baseline) break;
      const auto check_time = std::chrono::steady_clock::now() - start;
      std::this_thread::sleep_for(std::max<std::chrono::nanoseconds>(kMinPause, check_time));
      if (interrupted()) return kExitCancelled;
    }
    for (Observation last = observe_files();;) {
      std::this_thread::sleep_for(kSettleTime);
      Observation current = observe_files();
      if (interrupted()) return kExitCancelled;
      if (current == last) break;
      last = std::move(current);
    }
  }
}

}  // namespace kiln::cli
