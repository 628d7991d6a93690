// Outputs of the command and their places: streams, the files of the user, and what an interrupt leaves.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "base/formatted.h"
#include "cli/call.h"
#include "cli/command_scene.h"
#include "cli/interrupted.h"
#include "kiln/bake.h"
#include "kiln/device.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
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
  expect_failure({"simplify", high, "--faces", "100", "--out", high}, 2,
                 {"high.obj", "is an input of this run"});
  expect_failure({"bake", high, low, "--out", scene, "--json", scene / "low_normal.png"}, 2,
                 {"low_normal.png", "Two outputs"});
  expect_failure({"bake", high, low, "--out", scene, "--save-match", scene / "m.png"}, 2, {".exr"});
  // A low poly of the user's that has the name of the one that would be made.
  std::ofstream(scene / "high_low.obj") << "# mine\n";
  expect_failure({"bake", high, "--out", scene, "--size", "64"}, 5, {"high_low.obj", "--force"});
  EXPECT_EQ(call_kiln({"bake", high, "--out", scene, "--size", "64", "--force"}).exit_code, 0);
  // Its own it writes again.
  EXPECT_EQ(call_kiln({"bake", high, "--out", scene, "--size", "64"}).exit_code, 0);
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
  const std::string text = test::read_file(log);
  EXPECT_EQ(text.rfind("before\n", 0), 0U);
  EXPECT_NE(text.find("mean_angle_degrees"), std::string::npos);
  EXPECT_EQ(call_kiln({"devices", "--json"}).exit_code == 0 || test::device() == nullptr, true);
  const std::string full =
      std::string("'") + test::kiln_command() + "' diff '" + a + "' '" + a + "' > /dev/full 2>&-";
  EXPECT_EQ(WEXITSTATUS(std::system(full.c_str())), 5);
}

/// Runs a line of the shell, in which `kiln` is the command. \returns its exit code
int shell(const std::string& line) {
  const std::string command =
      "kiln() { '" + std::string(test::kiln_command()) + "' \"$@\"; }; " + line;
  return WEXITSTATUS(std::system(command.c_str()));
}

TEST(Command, MakesFoldersThatFilesGoTo) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  const fs::path out = scene / "a/b", report = scene / "c/d/r.json";
  const auto run = [](std::vector<std::string> words) {
    const ProcessResult result = call_kiln(std::move(words));
    EXPECT_EQ(result.exit_code, 0) << result.errors;
  };
  run({"bake", scene / "high.obj", scene / "low.obj", "--size", "16", "--out", out, "--json",
       report, "--save-match", scene / "e/f/m.exr"});
  EXPECT_TRUE(fs::exists(out / "low_normal.png"));
  EXPECT_TRUE(fs::exists(report));
  EXPECT_TRUE(fs::exists(scene / "e/f/m.exr"));
  const std::string map = out / "low_normal.png";
  run({"diff", map, map, "--out", scene / "g/h/d.png", "--json", scene / "i/j/r.json"});
  EXPECT_TRUE(fs::exists(scene / "g/h/d.png"));
  EXPECT_TRUE(fs::exists(scene / "i/j/r.json"));
  run({"simplify", scene / "high.obj", "--faces", "50", "--out", scene / "k/l/low.obj"});
  EXPECT_TRUE(fs::exists(scene / "k/l/low.obj"));
  run({"render", scene / "high.obj", "--size", "16", "--out", scene / "m/n/p.png"});
  EXPECT_TRUE(fs::exists(scene / "m/n/p.png"));
}

TEST(Command, GoesOnWhereItsReaderHasReadEnough) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  const std::string bake = "kiln bake '" + (scene / "high.obj").string() + "' '" +
                           (scene / "low.obj").string() + "' --size 16 --out '" + scene.string();
  const std::string errors = (scene / "errors.txt").string();
  // A reader that reads nothing at all: each line meets a closed pipe.
  for (const std::string more : {"", " --json -"}) {
    const fs::path out = scene / ("out" + std::to_string(more.size()));
    EXPECT_EQ(shell("(" + bake + "/" + out.filename().string() + "'" + more + " 2> '" + errors +
                    "'; echo $? > '" + (scene / "code").string() + "') | true; sleep 1"),
              0);
    std::ifstream code(scene / "code");
    int value = -1;
    for (int tries = 0; tries < 100 && !(code >> value); ++tries) {
      usleep(100000);
      code.close();
      code.clear();
      code.open(scene / "code");
    }
    EXPECT_EQ(value, 0);
    EXPECT_TRUE(fs::exists(out / "low_normal.png"));
    fs::remove(scene / "code");
    EXPECT_EQ(test::read_file(errors).find("kiln:"), std::string::npos);
  }
}

TEST(Command, WritesNothingIntoFilesWhereStreamsAreClosed) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  const std::string high = scene / "high.obj", low = scene / "low.obj";
  ASSERT_EQ(call_kiln({"bake", high, low, "--size", "16", "--out", scene / "good"}).exit_code, 0);
  const std::string wanted = test::read_file(scene / "good/low_normal.png");
  ASSERT_FALSE(wanted.empty());
  int number = 0;
  const auto bake = [&](const std::string& more) {
    const fs::path out = scene / std::to_string(++number);
    const int code = shell("kiln bake '" + high + "' '" + low + "' --size 16 --out '" +
                           out.string() + "' " + more);
    if (fs::exists(out / "low_normal.png")) {
      EXPECT_EQ(test::read_file(out / "low_normal.png"), wanted) << more;
    }
    return std::pair(code, fs::exists(out / "low_normal.png"));
  };
  using Result = std::pair<int, bool>;
  // A report that standard output cannot take is an error, as on a full disk.
  EXPECT_EQ(bake("<&- >&- 2> /dev/null"), Result(5, false));
  EXPECT_EQ(bake("<&- >&- 2>&-"), Result(5, false));
  EXPECT_EQ(bake("--quiet <&- >&- 2>&-"), Result(0, true));
  EXPECT_EQ(bake("<&- 2>&- > /dev/null"), Result(0, true));
}

TEST(Command, EscapesControlCharactersOfFiles) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  std::ofstream evil(scene / "evil.obj");
  evil << "mtllib \x1b]0;title\x07\xc2\x9b.mtl\n" << test::read_file(scene / "high.obj");
  evil.close();
  const ProcessResult result = call_kiln({"bake", scene / "evil.obj", scene / "low.obj", "--size",
                                          "16", "--maps", "color", "--out", scene / "out"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.errors.find("\\x1b]0;title\\x07\\xc2\\x9b.mtl"), std::string::npos)
      << result.errors;
  EXPECT_EQ(result.errors.find('\x1b'), std::string::npos);
}

TEST(Command, RefusesToWriteWhereItCannot) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  // Folders that it makes go where the run fails, all of them.
  expect_failure({"bake", high, scene / "no.obj", "--out", scene / "no/such/folder"}, 3,
                 {"no.obj"});
  EXPECT_FALSE(fs::exists(scene / "no"));
  expect_failure({"bake", high, low, "--out", scene / "high.obj/no/folder"}, 5, {"high.obj/no"});
  expect_failure({"bake", high, low, "--out", high}, 2, {"high.obj", "an input of this run"});
  std::ofstream(scene / "file") << "";
  expect_failure({"bake", high, low, "--out", scene / "file"}, 5, {"file", "folder"});
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
  const fs::path scene = make_scene(200000);
  // While it reads the meshes, builds the hierarchy, matches. Half a second is what is promised.
  for (const double after : {0.02, 0.2, 0.5, 1.0}) {
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
  for (const std::uintmax_t bytes : {0U, 250'000U}) {
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
          run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", out, "--size", "1024",
                    "--max-distance", "10%", "--recall", "0"},
                   options);
      killed = result.exit_code == 128 + 9;
      EXPECT_TRUE(killed || result.exit_code == 0) << result.errors;
      for (const std::string& name : names(out)) {
        if (name == "low_normal.png") {
          EXPECT_EQ(load_image(out / name).width, 1024U);
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
  const ProcessResult plain = call_kiln(arguments);
  EXPECT_EQ(plain.errors.find('\r'), std::string::npos);
  EXPECT_TRUE(test::only_warnings(plain.errors)) << plain.errors;
  EXPECT_NE(plain.output.find("wrote"), std::string::npos);
  std::vector<std::string> quiet_arguments = arguments;
  quiet_arguments.push_back("--quiet");
  const ProcessResult quiet = call_kiln(quiet_arguments);
  EXPECT_EQ(quiet.output, "");
  EXPECT_EQ(quiet.errors, plain.errors);
}

TEST(Command, DevicesSaysWhatMatters) {
  KILN_REQUIRE_DEVICE();
  const ProcessResult result = call_kiln({"devices"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word : {"driver", "memory", "largest buffer", "64-bit atomics", "rounded"}) {
    EXPECT_NE(result.output.find(word), std::string::npos) << word;
  }
  const auto gib = [](std::uint64_t bytes) {
    return formatted("%.1f GiB", static_cast<double>(bytes) / 1073741824.0);
  };
  for (const DeviceInfo& info : list_devices()) {
    const std::string line = "memory " + gib(info.memory_bytes) + ", largest buffer " +
                             gib(info.largest_buffer_bytes) + ", 64-bit atomics: ";
    EXPECT_NE(result.output.find(line), std::string::npos) << line << result.output;
  }
  const auto list = nlohmann::json::parse(call_kiln({"devices", "--json"}).output);
  EXPECT_FALSE(list.empty());
}

/// What was measured is printed, stored, and used by later runs; a damaged file is named.
TEST(Command, DevicesCanBeTuned) {
  KILN_REQUIRE_DEVICE();
  const fs::path cache = test::scratch_folder();
  fs::permissions(cache, fs::perms(0700));
  test::ProcessOptions options;
  options.environment = {{"POCL_CACHE_DIR", cache},
                         {"KILN_DEVICE", std::to_string(test::device()->info().index)}};
  const ProcessResult tuned =
      test::run_kiln({"devices", "--tune", "--tune-faces", "2000", "--json"}, options);
  ASSERT_EQ(tuned.exit_code, 0) << tuned.errors;
  const auto report = nlohmann::json::parse(tuned.output);
  EXPECT_EQ(report["device"], test::device()->info().name);
  EXPECT_EQ(report["builds"].size(), 4U);
  for (const auto& trial : report["builds"]) {
    for (const char* key : {"host_build_seconds", "host_rays_seconds", "device_build_seconds",
                            "device_rays_seconds"}) {
      EXPECT_GT(trial[key], 0) << key;
    }
  }
  EXPECT_GE(report["groups"].size(), 16U);  // four families with four sizes; five on GPUs
  const fs::path file = report["file"].get<std::string>();
  ASSERT_TRUE(fs::exists(file));
  std::ifstream in(file);
  std::size_t stored_count = 0;
  for (std::string key, value; in >> key && std::getline(in >> std::ws, value); ++stored_count) {
    ASSERT_TRUE(report.contains(key)) << key;
    const nlohmann::json& reported = report[key];
    const bool is_null = value == "never" || value == "default";
    EXPECT_EQ(reported.is_string() ? reported.get<std::string>() : reported.dump(),
              is_null ? "null" : value)
        << key;
  }
  EXPECT_EQ(stored_count, 10U);

  const ProcessResult table =
      test::run_kiln({"devices", "--tune", "--tune-faces", "1000"}, options);
  EXPECT_EQ(table.exit_code, 0) << table.errors;
  for (const char* word : {"960 triangles", "nearest points", "match by views", "stored in"})
    EXPECT_NE(table.output.find(word), std::string::npos) << word << "\n" << table.output;

  const ProcessResult sound = test::run_kiln({"devices"}, options);
  EXPECT_EQ(sound.errors.find("tuning"), std::string::npos) << sound.errors;
  std::ofstream(file) << "damaged";
  const ProcessResult damaged = test::run_kiln({"devices"}, options);
  EXPECT_EQ(damaged.exit_code, 0);
  EXPECT_NE(damaged.errors.find(file.string()), std::string::npos) << damaged.errors;
}

TEST(Command, DevicesRefusesOptionsThatNeedOthers) {
  const auto refused = [](const std::vector<std::string>& words) {
    const ProcessResult result = call_kiln(words);
    EXPECT_EQ(result.exit_code, 2);
    return result.errors;
  };
  EXPECT_NE(refused({"devices", "--tune", "--warm"}).find("exclude each other"), std::string::npos);
  EXPECT_NE(refused({"devices", "--tune-faces", "2000"}).find("--tune"), std::string::npos);
  EXPECT_NE(refused({"devices", "--device", "0"}).find("--warm or --tune"), std::string::npos);
  EXPECT_NE(refused({"devices", "--tune", "--tune-faces", "10"}).find("1000"), std::string::npos);
}

}  // namespace
}  // namespace kiln
