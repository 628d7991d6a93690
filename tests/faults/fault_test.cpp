// One call of the C library fails, anywhere in a run: a documented exit code, in time, a message that names the
// file, nothing left, and all outputs are the old ones or the new ones.
//
// KILN_FAULT_POINTS  how many calls of each command are tried, shared among the kinds of call: all of a kind
//                    that has few, then as many of each. Commands that take long are tried as often as the
//                    others then, two at a time on two processors; else once or not at all
// KILN_FAULT_CALLS   which kinds: "write,rename"
// KILN_FAULT_SECONDS when to stop: each command has its share of them. Points are taken in an order that
//                    spreads them over the run, so what was left out lies everywhere
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "faults/commands.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::FaultCommand;
using test::Often;
using test::ProcessOptions;
using test::ProcessResult;
using test::run_kiln;
using Words = std::vector<std::string>;
using Clock = std::chrono::steady_clock;
using Files = std::map<std::string, std::string>;

// A run hangs if it takes longer. One whose cache of kernels fails compiles all kernels again.
constexpr double kMaxSeconds = 60;

constexpr long kKinds = 10;  // of calls

/// A whole number of the environment, or nothing.
long number_of(const char* variable) {
  const char* text = std::getenv(variable);
  return text == nullptr ? 0 : std::max(1L, std::atol(text));
}

bool all_points() { return number_of("KILN_FAULT_POINTS") != 0; }

bool is_wanted(const std::string& call) {
  const char* wanted = std::getenv("KILN_FAULT_CALLS");
  return wanted == nullptr ||
         ("," + std::string(wanted) + ",").find("," + call + ",") != std::string::npos;
}

Files all_files(const fs::path& folder) {
  Files files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    files[fs::relative(entry.path(), folder)] = test::read_file(entry.path());
  }
  return files;
}

/// Files that hold times, or name a process: never the same bytes twice.
bool holds_times(const std::string& name) {
  return name.ends_with(".json") || name.ends_with(".csv") || name.ends_with(".md");
}

std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// True if a file is what a run without faults writes: its bytes, or a whole file of its kind.
bool is_whole(const std::string& name, const std::string& bytes, const std::string& good) {
  if (!holds_times(name)) return bytes == good;
  if (!name.ends_with(".json")) return lines_of(bytes) == lines_of(good);
  const nlohmann::json now = nlohmann::json::parse(bytes, nullptr, false);
  const nlohmann::json then = nlohmann::json::parse(good, nullptr, false);
  if (now.is_discarded() || then.is_discarded() || now.size() != then.size()) return false;
  return !now.is_object() ||
         std::equal(now.items().begin(), now.items().end(), then.items().begin(),
                    then.items().end(),
                    [](const auto& a, const auto& b) { return a.key() == b.key(); });
}

/// All of them and no others, each whole.
bool are_whole(const Files& files, const Files& good) {
  return std::equal(files.begin(), files.end(), good.begin(), good.end(),
                    [](const auto& a, const auto& b) {
                      return a.first == b.first && is_whole(a.first, a.second, b.second);
                    });
}

/// Commands that take seconds are left out where no number of points was asked for.
std::vector<FaultCommand> chosen_commands() {
  std::vector<FaultCommand> chosen;
  for (const FaultCommand& command : test::fault_commands()) {
    if (all_points() || command.often != Often::never) chosen.push_back(command);
  }
  return chosen;
}

/// Share of `points` for each kind, of `calls[kind]`.
std::map<std::string, long> shares(const std::map<std::string, long>& calls, long points) {
  std::map<std::string, long> shares;
  for (bool more = true; more && points > 0;) {
    more = false;
    for (const auto& [kind, count] : calls) {
      if (points == 0 || shares[kind] == count) continue;
      ++shares[kind];
      --points;
      more = true;
    }
  }
  return shares;
}

struct Fault {
  std::string call;
  long number = 0;
};

/// `some` of `count` calls, spread over the run, the first and the last among them; one alone lies at three
/// quarters.
void add_spread(std::vector<Fault>& faults, const std::string& call, long count, long some) {
  for (long i = 0; i < some; ++i) {
    faults.push_back(
        {call, some == 1 ? std::max(1L, count * 3 / 4) : 1 + i * (count - 1) / (some - 1)});
  }
}

/// Runs a command in a folder of its own, once at a time.
class Runner {
 public:
  Runner(const FaultCommand& command, fs::path in, std::string path)
      : command_(command), in_(std::move(in)), path_(std::move(path)) {
    fs::create_directory(temporary());
    const char* cache = std::getenv("POCL_CACHE_DIR");
    if (!command.without_binaries || cache == nullptr) return;
    // All of PoCL's own, but a folder of binaries that is emptied.
    fs::create_directory(root / "cache");
    for (const auto& entry : fs::directory_iterator(cache)) {
      if (entry.path().filename() == "kiln") continue;
      fs::create_symlink(fs::absolute(entry.path()), root / "cache" / entry.path().filename());
    }
  }

  struct Outcome {
    ProcessResult process;
    Files files;
    bool folder = false;  ///< True if there is one for the outputs
  };

  /// \param before  what is in the folder; empty: there is no folder
  Outcome run(const std::map<std::string, std::string>& environment,
              const Files& before = {}) const {
    const fs::path out = root / "out";
    fs::remove_all(out);
    if (!before.empty()) fs::create_directory(out);
    for (const auto& [name, bytes] : before) std::ofstream(out / name, std::ios::binary) << bytes;
    ProcessOptions options;
    options.environment = environment;
    options.environment["TMPDIR"] = temporary();
    options.environment["PATH"] = path_;
    if (fs::exists(root / "cache")) {
      options.environment["POCL_CACHE_DIR"] = root / "cache";
      fs::remove_all(root / "cache" / "kiln");
    }
    options.timeout_seconds = 2 * kMaxSeconds;
    Words words = command_.words(in_, out);
    // The file there is no OBJ of Kiln's.
    if (!before.empty() && (words[0] == "bake" || words[0] == "simplify" || words[0] == "volume")) {
      words.push_back("--force");
    }
    Outcome result;
    result.process = run_kiln(words, options);
    result.folder = fs::exists(out);
    if (result.folder) result.files = all_files(out);
    return result;
  }

  fs::path temporary() const { return root / "temporary"; }

  const fs::path root = test::scratch_folder();

 private:
  const FaultCommand& command_;
  fs::path in_;
  std::string path_;
};
using Outcome = Runner::Outcome;

class Faults : public ::testing::TestWithParam<FaultCommand> {
 protected:
  void SetUp() override {
    KILN_REQUIRE_DEVICE();
    if (fs::path(test::fault_library()).empty()) GTEST_SKIP() << "no library of faults";
    in_ = test::fault_inputs();
    // A picture of data takes Python seconds, and is no part of what is whole.
    const std::string path = test::path_without("python3");
    const unsigned runners = all_points() ? std::max(1U, std::thread::hardware_concurrency()) : 1;
    for (unsigned i = 0; i < runners; ++i) {
      runners_.push_back(std::make_unique<Runner>(GetParam(), in_, path));
    }
    runners_[0]->run({});  // kernels go to the cache
    count();
    ASSERT_EQ(counts_.size(), kKinds);
    for (const auto& file : new_) old_[file.first] = "old " + file.first;
  }

  /// Which files a run writes, and how often it calls what.
  void count() {
    const fs::path file = runners_[0]->root / "counts";
    const Outcome counted =
        runners_[0]->run({{"LD_PRELOAD", test::fault_library()}, {"KILN_FAULT_COUNT", file}});
    good_code_ = counted.process.exit_code;
    ASSERT_EQ(good_code_, std::string(GetParam().name) == "diff" ? 1 : 0) << counted.process.errors;
    good_lines_ = lines_of(counted.process.output);
    new_ = counted.files;
    clean_seconds_ = counted.process.seconds;
    std::ifstream in(file);
    std::string name;
    for (long calls = 0; in >> name >> calls;) counts_[name] = calls;
  }

  void expect_good(const Runner& runner, const Outcome& run, const Files& before,
                   const std::string& fault) {
    SCOPED_TRACE(fault + ": " + run.process.errors);
    const ProcessResult& process = run.process;
    const int code = process.exit_code;
    EXPECT_TRUE(std::set({0, 1, 3, 4, 5}).contains(code)) << "exit code " << code;
    EXPECT_LE(process.seconds, kMaxSeconds);
    EXPECT_TRUE(fs::is_empty(runner.temporary())) << "a temporary folder was left";
    if (code == good_code_ && (code == 0 || run.files != before)) {
      EXPECT_TRUE(are_whole(run.files, new_)) << "not all of the new files";
      EXPECT_EQ(lines_of(process.output), good_lines_) << "not all that is said";
      ++kept_going_;
      return;
    }
    ++failed_;
    EXPECT_TRUE(run.files == before) << "not the old files";
    EXPECT_EQ(run.folder, !before.empty()) << "an empty folder was left";
    EXPECT_NE(process.errors.find("kiln: "), std::string::npos) << "no message";
    if (code != 3 && code != 5) return;
    const fs::path place = code == 5 ? runner.root : in_;
    EXPECT_TRUE(process.errors.find(place.string()) != std::string::npos ||
                process.errors.find("tandard output") != std::string::npos)
        << "no file is named";
  }

  /// Faults in the order in which they are tried.
  std::vector<Fault> faults() const {
    std::map<std::string, long> wanted;
    for (const auto& [call, count] : counts_) {
      if (is_wanted(call) && count > 0) wanted[call] = count;
    }
    std::vector<Fault> faults;
    if (!all_points() && GetParam().often != Often::always) {
      for (const char* call : {"rename", "write"}) add_spread(faults, call, wanted[call], 1);
      return faults;
    }
    const long points = all_points() ? number_of("KILN_FAULT_POINTS") : 2 * kKinds;
    for (const auto& [call, some] : shares(wanted, points)) {
      add_spread(faults, call, wanted[call], some);
    }
    std::shuffle(faults.begin(), faults.end(), std::mt19937(1));
    return faults;
  }

  /// Until when this command is tried.
  static Clock::time_point end() {
    static const Clock::time_point begin = Clock::now();
    static int left = ::testing::UnitTest::GetInstance()->test_to_run_count();
    const long seconds = number_of("KILN_FAULT_SECONDS");
    if (seconds == 0) return Clock::time_point::max();
    const Clock::time_point now = Clock::now();
    const auto rest = begin + std::chrono::seconds(seconds) - now;
    return now + rest / std::max(1, left--);
  }

  void try_one(const Runner& runner, const Fault& fault, bool into_old) {
    const std::string text = fault.call + ":" + std::to_string(fault.number);
    const Files before = into_old ? old_ : Files();
    expect_good(runner,
                runner.run({{"LD_PRELOAD", test::fault_library()}, {"KILN_FAULT", text}}, before),
                before, text);
  }

  fs::path in_;
  std::vector<std::unique_ptr<Runner>> runners_;
  Files new_, old_;
  std::map<std::string, long> counts_;
  int good_code_ = 0;
  std::size_t good_lines_ = 0;
  double clean_seconds_ = 0;
  std::atomic<long> failed_{0}, kept_going_{0};
};

TEST_P(Faults, EndInOrder) {
  EXPECT_GT(counts_.at("malloc"), 100);
  const std::vector<Fault> faults = this->faults();
  const Clock::time_point end = this->end();
  std::atomic<std::size_t> next{0};
  {
    std::vector<std::jthread> threads;
    for (const auto& runner : runners_) {
      threads.emplace_back([&] {
        for (std::size_t i = next++; i < faults.size() && Clock::now() < end; i = next++) {
          try_one(*runner, faults[i],
                  i % 2 == 0);  // the others into a folder that is not there yet
        }
      });
    }
  }
  long calls = 0;
  for (const auto& count : counts_) calls += count.second;
  std::printf(
      "%ld of %zu points of %s (%ld calls, %.2f s each): %ld runs failed in order, %ld went on\n",
      failed_ + kept_going_, faults.size(), GetParam().name, calls, clean_seconds_, failed_.load(),
      kept_going_.load());
}

INSTANTIATE_TEST_SUITE_P(All, Faults, ::testing::ValuesIn(chosen_commands()),
                         [](const auto& command) { return std::string(command.param.name); });

}  // namespace
}  // namespace kiln
