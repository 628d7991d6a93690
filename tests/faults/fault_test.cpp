// One call of the C library fails, anywhere in a run: a documented exit code, in time, nothing left, and old
// outputs as they were. KILN_FAULT_POINTS sets how many calls of each kind are tried (all that there are,
// where these are fewer).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
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

/// Reports hold times.
Files without_reports(Files files) {
  std::erase_if(files, [](const auto& file) { return file.first.ends_with("report.json"); });
  return files;
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

struct Command {
  const char* name;
  Words (*words)(const fs::path& in, const fs::path& out);
  /// Where a run takes seconds: one point each of some calls.
  bool slow = false;
};

const Command kCommands[] = {
    {"bake",
     [](const fs::path& in, const fs::path& out) {
       return Words{"bake", in / "high.obj", in / "low.obj",     "--size",
                    "16",   "--maps",        "normal,mask",      "--out",
                    out,    "--json",        out / "report.json"};
     }},
    {"simplify",
     [](const fs::path& in, const fs::path& out) {
       return Words{"simplify", in / "high.obj", "--faces", "60", "--out", out / "light.obj"};
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
       return Words{"gallery", in / "high.obj", in / "low.obj",     "--size", "16",
                    "--match", "ray",           "--picture-size",   "64",     "--out",
                    out,       "--json",        out / "report.json"};
     },
     true},
};

class Faults : public ::testing::TestWithParam<Command> {
 protected:
  void SetUp() override {
    KILN_REQUIRE_DEVICE();
    if (fs::path(test::fault_library()).empty()) GTEST_SKIP() << "no library of faults";
    in_ = make_inputs();
    root_ = test::scratch_folder();
    run({});  // kernels go to the cache
    new_ = run({}).files;
    ASSERT_FALSE(new_.empty());
    for (const auto& file : new_) old_[file.first] = "old " + file.first;
  }

  struct Run {
    ProcessResult process;
    Files files;
  };

  Run run(const std::map<std::string, std::string>& environment, const Files& before = {}) {
    const fs::path out = root_ / "out";
    fs::remove_all(out);
    fs::create_directory(out);
    for (const auto& [name, bytes] : before) std::ofstream(out / name, std::ios::binary) << bytes;
    ProcessOptions options;
    options.environment = environment;
    options.timeout_seconds = 2 * kMostSecondsCompiling;
    Words words = GetParam().words(in_, out);
    // What is there is no OBJ of Kiln's.
    if (!before.empty() && (words[0] == "bake" || words[0] == "simplify" || words[0] == "volume")) {
      words.push_back("--force");
    }
    Run result;
    result.process = run_kiln(words, options);
    result.files = all_files(out);
    return result;
  }

  std::map<std::string, long> counts() {
    const fs::path file = root_ / "counts";
    run({{"LD_PRELOAD", test::fault_library()}, {"KILN_FAULT_COUNT", file}});
    std::map<std::string, long> result;
    std::ifstream in(file);
    std::string name;
    for (long count = 0; in >> name >> count;) result[name] = count;
    return result;
  }

  void expect_good(const Run& run, const std::string& fault, double most_seconds) {
    SCOPED_TRACE(fault + ": " + run.process.errors);
    const int code = run.process.exit_code;
    EXPECT_TRUE(std::set({0, 1, 3, 4, 5}).contains(code)) << "exit code " << code;
    const bool again = run.process.errors.find("once more") != std::string::npos;
    EXPECT_LE(run.process.seconds, again ? kMostSecondsCompiling : most_seconds);
    if (code == 0 || run.files != old_) {
      EXPECT_EQ(code, std::string(GetParam().name) == "diff" ? code : 0) << "not the old files";
      EXPECT_TRUE(without_reports(run.files) == without_reports(new_)) << "not the new files";
    }
    if (code != 0 && run.files == old_) {
      EXPECT_NE(run.process.errors.find("kiln: "), std::string::npos) << "no message";
    }
  }

  fs::path in_, root_;
  Files new_, old_;
};

TEST_P(Faults, EndInOrder) {
  const std::map<std::string, long> all = counts();
  ASSERT_EQ(all.size(), 7u);
  EXPECT_GT(all.at("malloc"), 100);
  const double clean = run({}).process.seconds;
  for (const auto& [name, count] : all) {
    const bool slow = GetParam().slow && std::getenv("KILN_FAULT_POINTS") == nullptr;
    if (slow && name != "malloc" && name != "write" && name != "rename") continue;
    const long some = slow ? 1 : std::min(points(), count);
    for (long i = 0; i < some; ++i) {
      // Spread over the run, the first and the last among them; one alone lies at three quarters.
      const long number =
          some == 1 ? std::max(1L, count * 3 / 4) : 1 + i * (count - 1) / (some - 1);
      const std::string fault = name + ":" + std::to_string(number);
      expect_good(run({{"LD_PRELOAD", test::fault_library()}, {"KILN_FAULT", fault}}, old_), fault,
                  kMostSeconds + 3 * clean);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Faults, ::testing::ValuesIn(kCommands),
                         [](const auto& command) { return std::string(command.param.name); });

}  // namespace
}  // namespace kiln
