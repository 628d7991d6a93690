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

/// Minimum pause between two checks. The pause is at least as long as the check, so that checks use at most half a
/// core.
constexpr std::chrono::milliseconds kPause(100);
/// A file counts as completely saved after this time without a change.
constexpr std::chrono::milliseconds kSettled(60);

/// Size, times and inode number of a file; empty if there is none.
std::string state_of(const std::string& path) {
  const auto facts = os::facts_of(std::filesystem::path(path));
  if (!facts) return {};
  return std::to_string(facts->bytes) + ":" + std::to_string(facts->modified_ns) + ":" +
         std::to_string(facts->changed_ns) + ":" + std::to_string(facts->id.file);
}

struct Look {
  std::map<std::string, std::string> states;
  std::string plan;
  bool operator==(const Look&) const = default;
};

/// The words that this program was called by, without --watch.
std::vector<std::string> own_words() {
  std::vector<std::string> words = os::own_words();
  std::erase(words, "--watch");
  if (words.empty()) {
    throw Error(ErrorCode::internal,
                "--watch reads /proc/self/cmdline, which is not there: run without it.");
  }
  return words;
}

/// Runs it, and waits.
void run_again(const std::vector<std::string>& words) {
  if (os::run_own_program(words, interrupted)) return;
  throw Error(ErrorCode::internal, "--watch cannot start a process: end others, and run again.");
}

}  // namespace

int run_watched(const std::function<std::set<std::string>()>& files,
                const std::function<std::string()>& plan, Console& console) {
  const std::vector<std::string> words = own_words();
  std::set<std::string> known = files();
  const auto look = [&] {
    Look now;
    for (const std::string& file : known) now.states[file] = state_of(file);
    now.plan = plan();
    return now;
  };
  for (;;) {
    const Look before = look();
    run_again(words);
    if (interrupted()) return kExitCancelled;
    known = files();
    Look seen = look();
    // Files saved during the run count as changed; files that the run found first count with their current state.
    for (const auto& [file, state] : before.states) {
      if (seen.states.count(file) != 0) seen.states[file] = state;
    }
    seen.plan = before.plan;
    console.line("watching " + counted(known.size(), "file") + ": Ctrl-C ends");
    for (;;) {
      const auto start = std::chrono::steady_clock::now();
      if (look() != seen) break;
      const auto took = std::chrono::steady_clock::now() - start;
      std::this_thread::sleep_for(std::max<std::chrono::nanoseconds>(kPause, took));
      if (interrupted()) return kExitCancelled;
    }
    for (Look last = look();;) {
      std::this_thread::sleep_for(kSettled);
      Look now = look();
      if (interrupted()) return kExitCancelled;
      if (now == last) break;
      last = std::move(now);
    }
  }
}

}  // namespace kiln::cli
