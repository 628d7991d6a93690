// One call of the C library fails, anywhere in a run: a documented exit code, in time, a message that names the
// file, nothing left, and all outputs are the old ones or the new ones. KILN_FAULT_POINTS sets how many calls of
// each kind are tried (all that there are, where these are fewer), KILN_FAULT_CALLS which kinds ("write,rename").
// With it, commands that take seconds are tried as often as the others; without it once or not at all.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::ProcessOptions;
using test::ProcessResult;
using test::run_kiln;
using Words = std::vector<std::string>;
using Files = std::map<std::string, std::string>;

constexpr double kMostSeconds = 5;
// Where the run is begun once more with an empty cache, all kernels are compiled again.
constexpr double kMostSecondsCompiling = 60;

long points() {
  const char* text = std::getenv("KILN_FAULT_POINTS");
  return text == nullptr ? 3 : std::max(1L, std::atol(text));
}

Files all_files(const fs::path& folder) {
  Files files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    files[fs::relative(entry.path(), folder)] = {std::istreambuf_iterator<char>(in), {}};
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

/// Whether a file is what a run without faults writes: its bytes, or a whole file of its kind.
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

fs::path make_inputs() {
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(500), folder / "high.obj");
  save_obj(test::BumpySphere::light(12, 6), folder / "low.obj");
  std::string voxels(4096, '\0');
  for (std::size_t i = 0; i < voxels.size(); ++i) voxels[i] = static_cast<char>(8 * (i % 16));
  std::ofstream(folder / "ramp.raw", std::ios::binary) << voxels;
  std::ofstream(folder / "ramp.mhd")
      << "ObjectType = Image\nNDims = 3\nDimSize = 16 16 16\nElementType = MET_UCHAR\n"
         "ElementDataFile = ramp.raw\n";
  Image image{16, 16, 3, std::vector<float>(768, 0.5F)};
  save_image(image, folder / "a.png", {.format = ImageFormat::png8});
  image.pixels[7] = 0.75F;
  save_image(image, folder / "b.png", {.format = ImageFormat::png8});
  return folder;
}

/// How often a command is tried where KILN_FAULT_POINTS is not set.
enum class Often { always, once, never };

struct Command {
  const char* name;
  Words (*words)(const fs::path& in, const fs::path& out);
  Often often = Often::always;
};

const Command kCommands[] = {
    {"bake",
     [](const fs::path& in, const fs::path& out) {
       return Words{
           "bake",   in / "high.obj", in / "low.obj", "--size", "4",      "--recall",         "0",
           "--maps", "normal,mask",   "--out",        out,      "--json", out / "report.json"};
     }},
    {"simplify",
     [](const fs::path& in, const fs::path& out) {
       return Words{"simplify", in / "high.obj", "--faces",        "60", "--size",
                    "64",       "--out",         out / "light.obj"};
     }},
    {"render",
     [](const fs::path& in, const fs::path& out) {
       return Words{"render", in / "high.obj", "--size", "32", "--out", out / "picture.png"};
     }},
    {"diff",
     [](const fs::path& in, const fs::path& out) {
       return Words{"diff", in / "a.png", in / "b.png", "--out", out / "picture.png"};
     }},
    {"volume",
     [](const fs::path& in, const fs::path& out) {
       return Words{"volume", in / "ramp.mhd", "--iso", "60", "--size", "64", "--out", out};
     }},
    // Pictures, maps and a report.
    {"gallery",
     [](const fs::path& in, const fs::path& out) {
       return Words{"gallery",
                    in / "high.obj",
                    in / "low.obj",
                    "--size",
                    "16",
                    "--match",
                    "ray",
                    "--picture-size",
                    "64",
                    "--pixels",
                    "64",
                    "--out",
                    out,
                    "--json",
                    out / "report.json"};
     },
     Often::once},
    // Textures, a mesh, data and a script to draw them.
    {"measure",
     [](const fs::path& in, const fs::path& out) {
       return Words{"measure",
                    in / "high.obj",
                    in / "low.obj",
                    "--match",
                    "ray",
                    "--size",
                    "16",
                    "--directions",
                    "12",
                    "--picture-size",
                    "64",
                    "--out",
                    out,
                    "--json",
                    out / "report.json"};
     },
     Often::never},
    {"chart",
     [](const fs::path& in, const fs::path& out) {
       return Words{"chart",
                    in / "high.obj",
                    in / "low.obj",
                    "--settings",
                    "ray",
                    "--size",
                    "16",
                    "--repeat",
                    "1",
                    "--out",
                    out};
     },
     Often::never},
    {"study",
     [](const fs::path& in, const fs::path& out) {
       return Words{"measure", in / "high.obj", "--study", "faces", "--size", "16", "--out", out};
     },
     Often::never},
};

bool all_points() { return std::getenv("KILN_FAULT_POINTS") != nullptr; }

/// Commands that take seconds are left out where no number of points was asked for.
std::vector<Command> chosen_commands() {
  std::vector<Command> chosen;
  for (const Command& command : kCommands) {
    if (all_points() || command.often != Often::never) chosen.push_back(command);
  }
  return chosen;
}

class Faults : public ::testing::TestWithParam<Command> {
 protected:
  void SetUp() override {
    KILN_REQUIRE_DEVICE();
    if (fs::path(test::fault_library()).empty()) GTEST_SKIP() << "no library of faults";
    in_ = make_inputs();
    root_ = test::scratch_folder();
    fs::create_directory(root_ / "temporary");
    without_python_ = test::path_without("python3");
    run({});  // kernels go to the cache
    count();
    ASSERT_EQ(counts_.size(), 7u);
    ASSERT_FALSE(new_.empty());
    for (const auto& file : new_) old_[file.first] = "old " + file.first;
  }

  struct Run {
    ProcessResult process;
    Files files;
    bool folder = false;  ///< Whether there is one for the outputs
  };

  /// \param before  what is in the folder; empty: there is no folder
  Run run(const std::map<std::string, std::string>& environment, const Files& before = {}) {
    const fs::path out = root_ / "out";
    fs::remove_all(out);
    if (!before.empty()) fs::create_directory(out);
    for (const auto& [name, bytes] : before) std::ofstream(out / name, std::ios::binary) << bytes;
    ProcessOptions options;
    options.environment = environment;
    options.environment["TMPDIR"] = root_ / "temporary";
    // A picture of data takes Python seconds, and is no part of what is whole.
    options.environment["PATH"] = without_python_;
    options.timeout_seconds = 2 * kMostSecondsCompiling;
    Words words = GetParam().words(in_, out);
    // What is there is no OBJ of Kiln's.
    if (!before.empty() && (words[0] == "bake" || words[0] == "simplify" || words[0] == "volume")) {
      words.push_back("--force");
    }
    Run result;
    result.process = run_kiln(words, options);
    result.folder = fs::exists(out);
    if (result.folder) result.files = all_files(out);
    return result;
  }

  /// Which files a run writes, and how often it calls what.
  void count() {
    const fs::path file = root_ / "counts";
    const Run counted = run({{"LD_PRELOAD", test::fault_library()}, {"KILN_FAULT_COUNT", file}});
    new_ = counted.files;
    clean_seconds_ = counted.process.seconds;
    std::ifstream in(file);
    std::string name;
    for (long calls = 0; in >> name >> calls;) counts_[name] = calls;
  }

  void expect_good(const Run& run, const Files& before, const std::string& fault) {
    SCOPED_TRACE(fault + ": " + run.process.errors);
    const ProcessResult& process = run.process;
    const int code = process.exit_code;
    EXPECT_TRUE(std::set({0, 1, 3, 4, 5}).contains(code)) << "exit code " << code;
    const bool again = process.errors.find("once more") != std::string::npos;
    EXPECT_LE(process.seconds, again ? kMostSecondsCompiling : kMostSeconds + 3 * clean_seconds_);
    EXPECT_TRUE(fs::is_empty(root_ / "temporary")) << "a temporary folder was left";
    const int good = std::string(GetParam().name) == "diff" ? 1 : 0;
    if (code == good && (code == 0 || run.files != before)) {
      EXPECT_TRUE(are_whole(run.files, new_)) << "not all of the new files";
      ++kept_going_;
      return;
    }
    ++failed_;
    EXPECT_TRUE(run.files == before) << "not the old files";
    EXPECT_EQ(run.folder, !before.empty()) << "an empty folder was left";
    EXPECT_NE(process.errors.find("kiln: "), std::string::npos) << "no message";
    if (code != 3 && code != 5) return;
    const fs::path place = code == 5 ? root_ : in_;
    EXPECT_TRUE(process.errors.find(place.string()) != std::string::npos ||
                process.errors.find("tandard output") != std::string::npos)
        << "no file is named";
  }

  /// Whether points of a call are tried, and how many.
  long points_of(const std::string& call, long calls) const {
    const char* wanted = std::getenv("KILN_FAULT_CALLS");
    if (wanted != nullptr &&
        ("," + std::string(wanted) + ",").find("," + call + ",") == std::string::npos) {
      return 0;
    }
    if (GetParam().often == Often::always || all_points()) return std::min(points(), calls);
    return call == "rename" || call == "write" ? 1 : 0;
  }

  fs::path in_, root_;
  std::string without_python_;
  Files new_, old_;
  std::map<std::string, long> counts_;
  double clean_seconds_ = 0;
  long failed_ = 0, kept_going_ = 0;
};

TEST_P(Faults, EndInOrder) {
  EXPECT_GT(counts_.at("malloc"), 100);
  long tried = 0;
  for (const auto& [name, count] : counts_) {
    const long some = points_of(name, count);
    for (long i = 0; i < some; ++i) {
      // Spread over the run, the first and the last among them; one alone lies at three quarters.
      const long number =
          some == 1 ? std::max(1L, count * 3 / 4) : 1 + i * (count - 1) / (some - 1);
      const std::string fault = name + ":" + std::to_string(number);
      // Every second one into a folder that is not there yet.
      const Files before = i % 2 == 0 ? old_ : Files();
      expect_good(run({{"LD_PRELOAD", test::fault_library()}, {"KILN_FAULT", fault}}, before),
                  before, fault);
      ++tried;
    }
  }
  std::printf("%ld points of %s: %ld runs failed in order, %ld went on\n", tried, GetParam().name,
              failed_, kept_going_);
}

INSTANTIATE_TEST_SUITE_P(All, Faults, ::testing::ValuesIn(chosen_commands()),
                         [](const auto& command) { return std::string(command.param.name); });

}  // namespace
}  // namespace kiln
