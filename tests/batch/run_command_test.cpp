// kiln run beside kiln bake: the same bytes, and failures that stop nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <filesystem>
#include <map>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "batch/assets.h"
#include "batch/batch_scene.h"
#include "batch/job_file.h"
#include "batch/runner.h"
#include "cli/call.h"
#include "io/file/output_set.h"
#include "kiln/files.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  if (!fs::exists(folder)) return files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = read_file(entry.path());
  }
  return files;
}

ProcessResult run_job(const fs::path& folder, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"run", (folder / "job.toml").string()});
  return call_kiln(more);
}

std::vector<json> lines_of(const std::string& text) {
  std::vector<json> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(json::parse(line));
  return lines;
}

TEST(RunCommand, WritesWhatBakeWrites) {
  const fs::path folder = make_studio({"props/crate", "rock", "stone"});
  write(folder / "job.toml", kStudioJob);
  const ProcessResult result = run_job(folder);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(held_outputs(), 0U);
  for (const char* const name : {"props/crate", "rock", "stone"}) {
    const fs::path out = folder / "by_bake" / name;
    const std::string mesh = (folder / "assets" / name).string();
    const ProcessResult bake =
        call_kiln({"bake", mesh + "_high.obj", mesh + "_low.obj", "--out", out.string(), "--size",
                   "16", "--maps", "normal,height", "--quiet"});
    ASSERT_EQ(bake.exit_code, 0) << bake.errors;
  }
  auto ours = files_of(folder / "out"), theirs = files_of(folder / "by_bake");
  EXPECT_EQ(ours.size(), 9U);  // two maps each, and whose they are
  for (const auto& [name, bytes] : theirs) {
    // Whose the maps are is said from the folder on.
    if (name.ends_with(".kiln.json")) continue;
    EXPECT_TRUE(ours[name] == bytes) << name;
  }
  // One after the other, and three at once.
  for (const char* const count : {"1", "3"}) {
    fs::remove_all(folder / "out");
    ASSERT_EQ(run_job(folder, {"--at-once", count}).exit_code, 0);
    EXPECT_TRUE(files_of(folder / "out") == ours) << count;
  }
}

TEST(RunCommand, WritesAllKindsOfFiles) {
  // glTF with its buffer, OBJ with its MTL, levels, saved matches and reports: all are placed, whatever they are called.
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "job.toml", R"([defaults]
size = 16
maps = "normal"
[[bake]]
high = "assets/{name}_high.obj"
faces = [60, 30]
out = "gltf/{name}.gltf"
[[bake]]
high = "assets/{name}_high.obj"
faces = 60
out = "obj/{name}.obj"
[[bake]]
high = "assets/{name}_high.obj"
low = "assets/{name}_low.obj"
out = "maps/{name}"
save_match = "match/{name}.exr"
json = "report/{name}.json"
reasons = true
)");
  const ProcessResult result = run_job(folder, {"--json", (folder / "all.json").string()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = json::parse(read_file(folder / "all.json"));
  ASSERT_EQ(report["assets"].size(), 8U);
  EXPECT_EQ(report["states"]["baked"], 8);
  for (const json& asset : report["assets"]) {
    for (const std::string file : asset["files"]) EXPECT_TRUE(fs::exists(file)) << file;
    EXPECT_TRUE(asset["report"].is_object());
  }
  for (const char* const file : {"gltf/a.gltf", "gltf/a.bin", "gltf/a_lod1.gltf", "gltf/b_lod1.bin",
                                 "obj/a.mtl", "match/b.exr", "report/a.json"}) {
    EXPECT_TRUE(fs::exists(folder / file)) << file;
  }
}

TEST(RunCommand, GoesOnWhereAnAssetFails) {
  const fs::path folder = make_studio({"a", "b", "c"});
  write(folder / "assets/b_high.obj", "v 0 0 nonsense\n");
  write(folder / "job.toml", std::string(kStudioJob) + "retries = 2\n");
  const ProcessResult result = run_job(folder, {"--json", "-"});
  EXPECT_EQ(result.exit_code, 1);
  const std::vector<json> lines = lines_of(result.output);
  ASSERT_EQ(lines.size(), 3U);
  for (const json& line : lines) {
    const bool bad = line["asset"] == "b";
    EXPECT_EQ(line["state"], bad ? "failed" : "baked");
    EXPECT_EQ(line["attempts"], bad ? 3 : 1);
    EXPECT_EQ(line["error"].is_null(), !bad);
    if (bad) EXPECT_EQ(line["error"]["code"], 3);
  }
  // The last line says what failed.
  EXPECT_NE(result.errors.rfind("kiln: b: "), std::string::npos) << result.errors;
  EXPECT_TRUE(names(folder / "out/b").empty());
  EXPECT_EQ(names(folder / "out/a").size(), 2U);
  EXPECT_EQ(held_outputs(), 0U);
}

TEST(RunBatch, BakesAgainAloneWhereMemoryDidNotSufficeBesideOthers) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = make_studio({"a", "b"});
  ExpandOptions expand;
  expand.allow_hooks = true;
  const std::vector<BatchAsset> assets =
      expand_job_file(
          parse_job_file(std::string(kStudioJob) + "before = \"before\"\nafter = \"after\"\n",
                         folder / "job.toml", {}),
          expand)
          .assets;
  ASSERT_EQ(assets.size(), 2U);
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> events;
  RunBatchOptions options;
  options.concurrent_bakes = 2;
  options.run_command = [&](const std::string& command, const std::string& input, std::string&) {
    std::unique_lock lock(mutex);
    const std::string event = command + " " + json::parse(input)["asset"].get<std::string>();
    const auto times = [&](const std::string& of) {
      return std::count(events.begin(), events.end(), of);
    };
    events.push_back(event);
    changed.notify_all();
    // a is in its bake while b fails for the first time.
    if (event == "before a") {
      changed.wait_for(lock, std::chrono::seconds(20), [&] { return times("before b") > 0; });
    }
    if (event == "before b" && times(event) == 1) throw std::bad_alloc();
    return 0;
  };
  OutputSet outputs;
  for (const AssetResult& result : run_batch(assets, options)) {
    EXPECT_EQ(result.state, AssetState::baked) << result.name << ": " << result.error;
    EXPECT_EQ(result.attempts, 1U);
  }
  const auto end_of_a = std::find(events.begin(), events.end(), "after a");
  EXPECT_EQ(std::count(end_of_a, events.end(), "before b"), 1) << "b was not baked again after a";
  EXPECT_EQ(std::count(events.begin(), events.end(), "before b"), 2);
}

TEST(RunCommand, SaysWhereABaselineHidesChangedPixels) {
  KILN_REQUIRE_DEVICE();
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  const auto run = [&](std::vector<std::string> more) {
    const ProcessResult result = run_job(folder, std::move(more));
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result.errors;
  };
  const std::string json = (folder / "a.json").string(), page = (folder / "a.html").string();
  const std::string words = "has no hashes of maps";
  run({"--json", json});
  EXPECT_NE(run({"--baseline", json, "--report", page}).find("'" + json + "' " + words),
            std::string::npos);
  EXPECT_NE(run({"--baseline", page, "--json", json}).find("this run's report " + words),
            std::string::npos);
  const std::string next = (folder / "b.html").string();
  EXPECT_EQ(run({"--baseline", page, "--report", next}).find(words), std::string::npos);
}

TEST(RunCommand, NamesFailedAssetsWhereNoReportCanBeWritten) {
  if (!fs::exists("/dev/full")) return;
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "assets/b_high.obj", "v 0 0 nonsense\n");
  write(folder / "job.toml", kStudioJob);
  const ProcessResult result = run_job(folder, {"--junit", "/dev/full", "--quiet"});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_NE(result.errors.find("No space left"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("kiln: b: "), std::string::npos) << result.errors;
}

TEST(RunCommand, ALimitThatIsMissedIsAFailureWithFiles) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml",
        std::string(kStudioJob) + "max_missed = 0\nmax_distance = \"0.001%\"\n");
  const ProcessResult result = run_job(folder, {"--json", "-"});
  EXPECT_EQ(result.exit_code, 1);
  const std::vector<json> lines = lines_of(result.output);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0]["state"], "failed");
}

TEST(RunCommand, RefusesMapsOfOneNameFromTwoAssets) {
  // "a_low_b" of "normal" and "a_low" of a map that is called "b_normal".
  const fs::path folder = make_studio({"a", "a_low_b"});
  fs::rename(folder / "assets/a_low_b_low.obj", folder / "assets/a_low_b.obj");
  write(folder / "job.toml", R"([defaults]
size = 8
out = "out"
retries = 2
[[bake]]
low = "assets/a_low.obj"
high = "assets/a_high.obj"
maps = ["b_normal=ao:ao-distance=2%"]
[[bake]]
low = "assets/a_low_b.obj"
high = "assets/a_high.obj"
maps = ["normal"]
)");
  const ProcessResult result = run_job(folder, {"--at-once", "1", "--json", "-"});
  expect_exit(result, 1, {"a_low_b_normal.png", "was already written by another bake of this run"});
  // What is wrong with the job is not tried again.
  for (const json& line : lines_of(result.output)) EXPECT_EQ(line["attempts"], 1) << line;
}

TEST(RunCommand, RunsHooksWithTheAsset) {
  std::signal(SIGPIPE, SIG_IGN);  // as the program does: a hook need not read
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml",
        std::string(kStudioJob) + "before = \"cat > before.json\"\nafter = \"cat > after.json\"\n");
  EXPECT_EQ(run_job(folder).exit_code, 2);
  ASSERT_EQ(run_job(folder, {"--allow-hooks"}).exit_code, 0);
  EXPECT_EQ(json::parse(read_file(folder / "before.json"))["asset"], "a");
  EXPECT_EQ(json::parse(read_file(folder / "after.json"))["state"], "baked");
  EXPECT_EQ(json::parse(read_file(folder / "after.json"))["files"].size(), 2U);
  EXPECT_GT(json::parse(read_file(folder / "after.json"))["seconds"], 0.0);
  fs::remove_all(folder / "out");
  write(folder / "job.toml", std::string(kStudioJob) + "before = \"echo not today; exit 7\"\n");
  const ProcessResult result = run_job(folder, {"--allow-hooks"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.errors.find("not today"), std::string::npos) << result.errors;
  EXPECT_FALSE(fs::exists(folder / "out/a"));
}

TEST(RunCommand, ListsChecksAndExplains) {
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "job.toml", kStudioJob);
  EXPECT_EQ(run_job(folder, {"--check"}).exit_code, 0);
  ProcessResult result = run_job(folder, {"--explain", "a", "--profile", "ci"});
  EXPECT_NE(result.output.find("size = 8"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("profile.ci"), std::string::npos) << result.output;
  result = run_job(folder, {"--explain", "?"});
  EXPECT_NE(result.output.find("b_high.obj"), std::string::npos) << result.output;
  EXPECT_NE(run_job(folder, {"--list"}).output.find("2 assets"), std::string::npos);
  expect_exit(run_job(folder, {"--explain", "x"}), 2, {"--list"});
  EXPECT_FALSE(fs::exists(folder / "out"));
  fs::remove(folder / "assets/b_high.obj");
  expect_exit(run_job(folder, {"--check"}), 3, {"b: there is no high"});
  // Options within options are wrong before any work, too.
  write(folder / "job.toml",
        std::string(kStudioJob) + "maps = [\"normal\", \"other=normal:space=object\"]\n");
  expect_exit(run_job(folder, {"--only", "a"}), 2, {"job.toml:", "space=object"});
  EXPECT_FALSE(fs::exists(folder / "out"));
  result = call_kiln({"run", "--print-schema"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_TRUE(json::parse(result.output).is_object());
  expect_exit(run_job(folder, {"--size", "0"}), 2, {"--size"});
  // A command as a job bakes the same.
  const std::string mesh = (folder / "assets/a").string();
  result = call_kiln({"bake", mesh + "_high.obj", mesh + "_low.obj", "--out",
                      (folder / "out").string(), "--size", "16", "--print-job"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_FALSE(fs::exists(folder / "out"));
  write(folder / "job.toml", result.output);
  ASSERT_EQ(run_job(folder).exit_code, 0);
  EXPECT_EQ(names(folder / "out").size(), 1U);
}

TEST(RunCommand, ATimeoutEndsABake) {
  const fs::path folder = make_studio({"a"}, 60000);
  write(folder / "job.toml", std::string(kStudioJob) + "timeout = 0.000001\n");
  const ProcessResult result = run_job(folder, {"--json", "-"});
  EXPECT_EQ(result.exit_code, 1);
  const std::vector<json> lines = lines_of(result.output);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0]["error"]["id"], "timeout");
  EXPECT_TRUE(names(folder / "out/a").empty());
}

}  // namespace
}  // namespace kiln::test
