// What the command writes where: streams, the files of the user, and what an interrupt leaves.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/command_scene.h"
#include "cli/interrupted.h"
#include "kiln/kiln.h"
#include "support/environment.h"
#include "support/process.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::expect_failure;
using test::make_scene;
using test::names;
using test::ProcessOptions;
using test::ProcessResult;
using test::run_kiln;

TEST(Command, LosesNoFileOfTheUser) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  expect_failure({"simplify", high, "--faces", "100", "--out", high}, 2, {"high.obj", "read"});
  expect_failure({"bake", high, low, "--out", scene, "--json", scene / "low_normal.png"}, 2,
                 {"low_normal.png", "Two outputs"});
  expect_failure({"bake", high, low, "--out", scene, "--save-match", scene / "m.png"}, 2, {".exr"});
  // A low poly of the user's that has the name of the one that would be made.
  std::ofstream(scene / "high_low.obj") << "# mine\n";
  expect_failure({"bake", high, "--out", scene, "--size", "64"}, 5, {"high_low.obj", "--force"});
  EXPECT_EQ(run_kiln({"bake", high, "--out", scene, "--size", "64", "--force"}).exit_code, 0);
  // Its own it writes again.
  EXPECT_EQ(run_kiln({"bake", high, "--out", scene, "--size", "64"}).exit_code, 0);
}

TEST(Command, ReportsGoToStreamsWithoutReplacingThem) {
  const fs::path folder = test::scratch_folder();
  save_image(Image{2, 2, 3, std::vector<float>(12, 0.5F)}, folder / "a.png", {ImageFormat::png8});
  const std::string a = folder / "a.png";
  const std::string log = folder / "log.txt";
  std::ofstream(log) << "before\n";
  const std::string command = std::string("'") + test::kiln_command() + "' diff '" + a + "' '" + a +
                              "' --json /dev/stdout >> '" + log + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::ifstream stream(log);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  EXPECT_EQ(text.rfind("before\n", 0), 0U);
  EXPECT_NE(text.find("mean_angle_degrees"), std::string::npos);
  EXPECT_EQ(run_kiln({"devices", "--json"}, {}).exit_code == 0 || test::device() == nullptr, true);
  const std::string full =
      std::string("'") + test::kiln_command() + "' diff '" + a + "' '" + a + "' > /dev/full 2>&-";
  EXPECT_EQ(WEXITSTATUS(std::system(full.c_str())), 5);
}

TEST(Command, RefusesToWriteWhereItCannot) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  expect_failure({"bake", high, low, "--out", scene / "no/such/folder"}, 5, {"no/such/folder"});
  EXPECT_FALSE(fs::exists(scene / "no"));
  expect_failure({"bake", high, low, "--out", high}, 5, {"high.obj", "folder"});
  if (geteuid() != 0) {
    fs::create_directory(scene / "locked");
    fs::permissions(scene / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    expect_failure({"bake", high, low, "--out", scene / "locked"}, 5, {"locked", "permissions"});
  }
  expect_failure({"bake", high, low, "--out", "/proc/self"}, 5, {"/proc/self"});
  // A disk that fills up: a limit on file size stands in for it, above the size of what PoCL writes
  // to its kernel cache and below that of the map.
  const fs::path out = scene / "full";
  ProcessOptions options;
  options.file_size_limit = 2000000;
  const ProcessResult result =
      run_kiln({"bake", high, low, "--out", out, "--size", "2048"}, options);
  EXPECT_EQ(result.exit_code, 5) << result.errors;
  EXPECT_NE(result.errors.find("low_normal.png"), std::string::npos) << result.errors;
  EXPECT_TRUE(names(out).empty());
}

TEST(Command, InterruptEndsItWithinHalfASecondAndLeavesNothing) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(400000);
  // While it reads the meshes, builds the hierarchy, matches. Half a second is what is promised.
  for (const double after : {0.02, 0.4, 1.0, 2.0}) {
    test::expect_interrupt_leaves_nothing({"bake", scene / "high.obj", scene / "low.obj", "--size",
                                           "8192", "--samples", "3", "--max-distance", "10%"},
                                          after, 1.0);
  }
}

TEST(Command, KillLeavesNoPartialMap) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  // As soon as a file is there, and while the map is written into it. Where that is over before it is seen, the
  // run ends in order: then once more.
  for (const std::uintmax_t bytes : {0U, 1'000'000U}) {
    bool killed = false;
    for (int tries = 0; tries < 4 && !killed; ++tries) {
      const fs::path out = scene / (std::to_string(bytes) + "-" + std::to_string(tries));
      ProcessOptions options;
      options.signal = 9;
      options.interrupt_when = [&] {
        std::error_code gone;
        const fs::directory_iterator files(out, gone);
        return std::any_of(files, fs::directory_iterator(), [&](const auto& entry) {
          return entry.file_size(gone) >= bytes && !gone;
        });
      };
      const ProcessResult result =
          run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", out, "--size", "2048",
                    "--max-distance", "10%", "--recall", "0"},
                   options);
      killed = result.exit_code == 128 + 9;
      EXPECT_TRUE(killed || result.exit_code == 0) << result.errors;
      for (const std::string& name : names(out)) {
        if (name == "low_normal.png") {
          EXPECT_EQ(load_image(out / name).width, 2048U);
        }
      }
    }
  }
}

TEST(Command, ShowsNoProgressWithoutATerminalAndNoResultsWhenQuiet) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  const std::vector<std::string> arguments = {"bake",  scene / "high.obj", scene / "low.obj",
                                              "--out", scene / "out",      "--size",
                                              "64",    "--max-distance",   "10%"};
  const ProcessResult plain = run_kiln(arguments);
  EXPECT_EQ(plain.errors.find('\r'), std::string::npos);
  EXPECT_TRUE(test::only_warnings(plain.errors)) << plain.errors;
  EXPECT_NE(plain.output.find("wrote"), std::string::npos);
  std::vector<std::string> quiet_arguments = arguments;
  quiet_arguments.push_back("--quiet");
  const ProcessResult quiet = run_kiln(quiet_arguments);
  EXPECT_EQ(quiet.output, "");
  EXPECT_EQ(quiet.errors, plain.errors);
}

TEST(Command, DevicesSaysWhatMatters) {
  KILN_REQUIRE_DEVICE();
  const ProcessResult result = run_kiln({"devices"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word : {"driver", "memory", "largest buffer", "64-bit atomics", "rounded"}) {
    EXPECT_NE(result.output.find(word), std::string::npos) << word;
  }
  const auto list = nlohmann::json::parse(run_kiln({"devices", "--json"}).output);
  EXPECT_FALSE(list.empty());
}

}  // namespace
}  // namespace kiln
