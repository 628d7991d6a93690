// Runs that end in the middle, disks that are full, caches that several write, and caches on servers.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "batch/batch_scene.h"
#include "cli/call.h"
#include "support/process.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// All files below a folder, hidden ones, too.
std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end;
       at.increment(error)) {
    std::error_code gone;
    if (at->is_regular_file(gone))
      files[at->path().lexically_relative(folder).string()] = read_file(at->path());
  }
  return files;
}

std::size_t count_of(const fs::path& folder) {
  std::size_t count = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end;
       at.increment(error)) {
    std::error_code gone;
    count += at->is_regular_file(gone) ? 1 : 0;
  }
  return count;
}

std::map<std::string, std::string> states_of(const std::string& output) {
  std::map<std::string, std::string> states;
  std::istringstream in(output);
  for (std::string line; std::getline(in, line);) {
    const json asset = json::parse(line);
    states[asset["asset"]] = asset["state"];
  }
  return states;
}

const std::vector<std::string> kNames = {"a", "b", "c", "d", "e", "f"};

fs::path copy_of(const fs::path& studio) {
  const fs::path folder = scratch_folder();
  fs::copy(studio / "assets", folder / "assets", fs::copy_options::recursive);
  fs::copy_file(studio / "job.toml", folder / "job.toml");
  return folder;
}

/// A studio and what its job writes.
struct Reference {
  fs::path studio;
  std::map<std::string, std::string> files;
};

Reference make_reference() {
  Reference reference{make_studio(kNames), {}};
  write(reference.studio / "job.toml", kStudioJob);
  const ProcessResult result =
      call_kiln({"run", (reference.studio / "job.toml").string(), "--no-cache"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  reference.files = files_of(reference.studio / "out");
  EXPECT_EQ(reference.files.size(), 3 * kNames.size());
  return reference;
}

TEST(Durability, ARunThatIsKilledAtAnyMomentGoesOn) {
  const Reference reference = make_reference();
  std::size_t killed = 0;
  // When so many files are there: of outputs, those out of sight counted; of the cache and its records.
  const std::pair<const char*, std::vector<std::size_t>> moments[] = {{"out", {1, 3, 8}},
                                                                      {".kiln", {2, 5, 11}}};
  for (const auto& [where, counts] : moments) {
    for (const std::size_t count : counts) {
      const fs::path folder = copy_of(reference.studio);
      ProcessOptions options;
      options.signal = SIGKILL;
      const fs::path watched = folder / where;
      options.interrupt_when = [&] { return count_of(watched) >= count; };
      const std::vector<std::string> command = {"run", (folder / "job.toml").string(), "--json",
                                                "-"};
      const ProcessResult first = run_kiln(command, options);
      killed += first.exit_code == 128 + SIGKILL ? 1 : 0;
      // What is in its place is whole.
      for (const auto& [name, bytes] : files_of(folder / "out")) {
        const auto wanted = reference.files.find(name);
        if (wanted != reference.files.end()) EXPECT_TRUE(bytes == wanted->second) << name;
      }
      const ProcessResult second = run_kiln(command);
      EXPECT_EQ(second.exit_code, 0) << second.errors;
      EXPECT_EQ(states_of(second.output).size(), kNames.size());
      EXPECT_TRUE(files_of(folder / "out") == reference.files) << where << " " << count;
      // And nothing is left to do.
      for (const auto& [name, state] : states_of(run_kiln(command).output))
        EXPECT_EQ(state, "unchanged") << name;
    }
  }
  EXPECT_GE(killed, 3U) << "the runs ended before";
}

TEST(Durability, AFullDiskInTheMiddleStopsNothingElse) {
  const Reference reference = make_reference();
  const fs::path disk = scratch_folder() / "disk";
  fs::create_directories(disk);
  std::size_t assets = 0;
  for (const auto& [name, bytes] : files_of(reference.studio / "assets"))
    assets += bytes.size() / 4096 * 4096 + 4096;
  // Room for some of what is written: tmpfs counts whole pages.
  for (const std::size_t pages : {4, 12, 30, 45}) {
    const std::string size = "size=" + std::to_string(assets + 4096 * (pages + 4));
    if (mount("none", disk.c_str(), "tmpfs", 0, size.c_str()) != 0)
      GTEST_SKIP() << "file systems cannot be mounted here";
    fs::copy(reference.studio / "assets", disk / "assets", fs::copy_options::recursive);
    fs::copy_file(reference.studio / "job.toml", disk / "job.toml");
    const std::vector<std::string> command = {"run", (disk / "job.toml").string(), "--json", "-"};
    const ProcessResult result = run_kiln(command);
    EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 1) << size << result.errors;
    const auto states = states_of(result.output);
    EXPECT_EQ(states.size(), kNames.size()) << size;
    const auto files = files_of(disk / "out");
    for (const auto& [name, state] : states) {
      for (const char* const map : {"normal", "height"}) {
        const std::string file = name + "/" + name + "_low_" + map + ".png";
        const auto found = files.find(file);
        EXPECT_EQ(found != files.end(), state == "baked") << size << " " << file << " " << state;
        if (found != files.end()) EXPECT_TRUE(found->second == reference.files.at(file)) << file;
      }
    }
    if (result.exit_code == 1) EXPECT_NE(result.errors.find("kiln: "), std::string::npos);
    // With room, the next run makes the rest.
    ASSERT_EQ(mount("none", disk.c_str(), "tmpfs", MS_REMOUNT, "size=64m"), 0);
    const ProcessResult second = run_kiln(command);
    EXPECT_EQ(second.exit_code, 0) << second.errors;
    EXPECT_TRUE(files_of(disk / "out") == reference.files) << size;
    ASSERT_EQ(umount(disk.c_str()), 0);
  }
}

/// A folder that is read-only, for root, too, while this lives.
class ReadOnly {
 public:
  explicit ReadOnly(fs::path folder) : folder_(std::move(folder)) {
    const char* const path = folder_.c_str();
    mounted_ = mount(path, path, nullptr, MS_BIND, nullptr) == 0;
    good_ =
        mounted_ && mount(nullptr, path, nullptr, MS_BIND | MS_REMOUNT | MS_RDONLY, nullptr) == 0;
  }
  ~ReadOnly() {
    if (mounted_) umount(folder_.c_str());
  }
  ReadOnly(const ReadOnly&) = delete;
  ReadOnly& operator=(const ReadOnly&) = delete;
  bool good() const { return good_; }

 private:
  fs::path folder_;
  bool mounted_ = false, good_ = false;
};

TEST(Durability, ReadOnlyOutputsAreNamedBeforeADeviceIsOpened) {
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "job.toml", kStudioJob);
  fs::create_directories(folder / "out" / "b");
  const std::vector<std::string> command = {"run", (folder / "job.toml").string(), "--json", "-"};
  ProcessOptions without_device;
  without_device.environment = {{"KILN_DEVICE", "no such device"}};
  {
    const ReadOnly out(folder / "out" / "b");
    if (!out.good()) GTEST_SKIP() << "file systems cannot be mounted here";
    const ProcessResult result = run_kiln(command, without_device);
    EXPECT_EQ(result.exit_code, 1);
    std::istringstream in(result.output);
    for (std::string line; std::getline(in, line);) {
      const json asset = json::parse(line);
      const std::string message = asset["error"]["message"];
      if (asset["asset"] == "b") {
        EXPECT_EQ(asset["error"]["code"], 5) << message;
        EXPECT_NE(message.find("'" + (folder / "out" / "b").string() + "' is write-protected"),
                  std::string::npos)
            << message;
        EXPECT_TRUE(message.starts_with("'" + (folder / "out/b/b_low_normal.png").string()))
            << "the file that a bake would write: " << message;
      } else {
        EXPECT_NE(message.find("no such device"), std::string::npos)
            << "it opened none: " << message;
      }
    }
    // The other is baked.
    EXPECT_EQ(states_of(run_kiln(command).output),
              (std::map<std::string, std::string>{{"a", "baked"}, {"b", "failed"}}));
  }
  ASSERT_EQ(run_kiln(command).exit_code, 0);
  const auto files = files_of(folder / "out");
  // Where nothing is left to bake, nothing is written.
  const ReadOnly out(folder / "out");
  ASSERT_TRUE(out.good());
  const ProcessResult unchanged = run_kiln(command);
  EXPECT_EQ(unchanged.exit_code, 0) << unchanged.errors;
  EXPECT_EQ(states_of(unchanged.output),
            (std::map<std::string, std::string>{{"a", "unchanged"}, {"b", "unchanged"}}));
  std::vector<std::string> again = command;
  again.emplace_back("--rebake");
  const ProcessResult refused = run_kiln(again, without_device);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_EQ(refused.output.find("no such device"), std::string::npos) << refused.output;
  EXPECT_TRUE(files_of(folder / "out") == files);
}

TEST(Durability, WriteProtectedFilesAreNamedBeforeADeviceIsOpened) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  const fs::path map = folder / "out/a/a_low_height.png";
  fs::create_directories(map.parent_path());
  write(map, "");
  const ReadOnly file(map);
  if (!file.good()) GTEST_SKIP() << "file systems cannot be mounted here";
  ProcessOptions without_device;
  without_device.environment = {{"KILN_DEVICE", "no such device"}};
  const ProcessResult run =
      run_kiln({"run", (folder / "job.toml").string(), "--json", "-"}, without_device);
  EXPECT_EQ(run.exit_code, 1);
  const std::string message = json::parse(run.output)["error"]["message"];
  EXPECT_TRUE(message.starts_with("'" + map.string() + "' cannot be written")) << message;
  const ProcessResult bake = run_kiln(
      {"bake", (folder / "assets/a_high.obj").string(), (folder / "assets/a_low.obj").string(),
       "--maps", "normal,height", "--out", map.parent_path().string()},
      without_device);
  EXPECT_EQ(bake.exit_code, 5) << bake.errors;
  EXPECT_NE(bake.errors.find("'" + map.string() + "': the file there is write-protected"),
            std::string::npos)
      << bake.errors;
}

TEST(Durability, TwoWritersOfOneCacheAreEqual) {
  const Reference reference = make_reference();
  const std::string cache = (scratch_folder() / "cache").string();
  const auto run = [&](const fs::path& folder) {
    return run_kiln({"run", (folder / "job.toml").string(), "--cache", cache, "--json", "-"});
  };
  const fs::path first = copy_of(reference.studio), second = copy_of(reference.studio);
  {
    std::jthread beside([&] { EXPECT_EQ(run(first).exit_code, 0); });
    EXPECT_EQ(run(second).exit_code, 0);
  }
  EXPECT_TRUE(files_of(first / "out") == reference.files);
  EXPECT_TRUE(files_of(second / "out") == reference.files);
  for (const auto& [name, bytes] : files_of(cache))
    EXPECT_EQ(name.find(".tmp-"), std::string::npos);
  const fs::path third = copy_of(reference.studio);
  for (const auto& [name, state] : states_of(run(third).output))
    EXPECT_EQ(state, "restored") << name;
  EXPECT_TRUE(files_of(third / "out") == reference.files);
}

TEST(Watch, BakesWhatWasSaved) {
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "job.toml", kStudioJob);
  const fs::path a = folder / "out/a/a_low_normal.png", b = folder / "out/b/b_low_normal.png",
                 c = folder / "out/c/c_low_normal.png";
  std::string first, beside;
  std::size_t step = 0;
  ProcessOptions options;
  // Each step waits for what the one before it brings about.
  options.interrupt_when = [&] {
    switch (step) {
      case 0:
        if (!fs::exists(a) || !fs::exists(b) || count_of(folder / ".kiln/records") < 2) break;
        first = read_file(a);
        beside = read_file(b);
        save_obj(BumpySphere::dense(80), folder / "assets/a_high.obj");
        ++step;
        break;
      case 1:
        if (!fs::exists(a) || read_file(a) == first) break;
        // A file that comes; and a job file that is broken for a while.
        save_obj(BumpySphere::dense(90), folder / "assets/c_high.obj");
        save_obj(BumpySphere::light(), folder / "assets/c_low.obj");
        ++step;
        break;
      case 2:
        if (!fs::exists(c)) break;
        write(folder / "job.toml", "[[bake]]\nhigh = 3\n");
        ++step;
        break;
      case 3:
        write(folder / "job.toml", std::string(kStudioJob) + "flip_y = true\n");
        beside = read_file(b);
        ++step;
        break;
      default:
        return read_file(b) != beside;
    }
    return false;
  };
  const ProcessResult result =
      run_kiln({"run", (folder / "job.toml").string(), "--watch"}, options);
  EXPECT_EQ(step, 4U);
  EXPECT_EQ(result.exit_code, 130) << result.errors;
  EXPECT_NE(result.output.find("a: baked in"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("(assets/a_high.obj changed)"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("3 assets in"), std::string::npos) << result.output;
  expect_exit(call_kiln({"run", (folder / "job.toml").string(), "--watch", "--rebake"}), 2,
              {"--watch", "--rebake"});
}

class CacheServer : public testing::Test {
 protected:
  ProcessResult run(const fs::path& folder, const std::string& mode,
                    const std::string& cache = "{url}") {
    return run_process({"python3", KILN_CACHE_SERVER, mode, (server_ / "files").string(),
                        (server_ / "log").string(), kiln_command(), "run",
                        (folder / "job.toml").string(), "--cache", cache, "--json", "-"});
  }
  std::size_t calls(const std::string& begin) const {
    std::istringstream in(read_file(server_ / "log"));
    std::size_t count = 0;
    for (std::string line; std::getline(in, line);) count += line.starts_with(begin) ? 1 : 0;
    return count;
  }
  void expect_states(const ProcessResult& result, const std::string& wanted) {
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const auto states = states_of(result.output);
    EXPECT_EQ(states.size(), kNames.size());
    for (const auto& [name, state] : states) EXPECT_EQ(state, wanted) << name << result.errors;
  }
  fs::path server_ = scratch_folder();
};

TEST_F(CacheServer, GivesWhatAnotherMachineMade) {
  if (found_program("python3").empty()) GTEST_SKIP() << "no python3 in PATH";
  const Reference reference = make_reference();
  const fs::path first = copy_of(reference.studio), second = copy_of(reference.studio);
  const ProcessResult result = run(first, "plain");
  if (result.errors.find("no libcurl") != std::string::npos)
    GTEST_SKIP() << "built without libcurl";
  expect_states(result, "baked");
  EXPECT_GE(calls("PUT /results/entries/"), kNames.size());
  expect_states(run(second, "plain"), "restored");
  EXPECT_TRUE(files_of(second / "out") == reference.files);
  // Nothing is asked for what is unchanged.
  const std::size_t before = calls("");
  expect_states(run(second, "plain"), "unchanged");
  EXPECT_EQ(calls(""), before);
  // A result that was cut off or changed on its way is none.
  for (const char* const mode : {"cutting", "changing"}) {
    const fs::path other = copy_of(reference.studio);
    expect_states(run(other, mode), "baked");
    EXPECT_TRUE(files_of(other / "out") == reference.files) << mode;
  }
}

TEST_F(CacheServer, ThatFailsIsLeftAlone) {
  if (found_program("python3").empty()) GTEST_SKIP() << "no python3 in PATH";
  const Reference reference = make_reference();
  for (const char* const mode : {"denying", "hanging up"}) {
    const fs::path folder = copy_of(reference.studio);
    const ProcessResult result = run(folder, mode);
    if (result.errors.find("no libcurl") != std::string::npos)
      GTEST_SKIP() << "built without libcurl";
    expect_states(result, "baked");
    EXPECT_TRUE(files_of(folder / "out") == reference.files);
    EXPECT_NE(result.errors.find("is not used any more: "), std::string::npos) << result.errors;
  }
  // Two bakes at once may each have a call on its way.
  EXPECT_LE(calls(""), 5U);
  const fs::path folder = copy_of(reference.studio);
  // Nobody listens there; a password is not shown.
  const ProcessResult result = run(folder, "plain", "http://user:secret@127.0.0.1:1/results");
  expect_states(result, "baked");
  EXPECT_NE(result.errors.find("127.0.0.1:1"), std::string::npos) << result.errors;
  EXPECT_EQ(result.errors.find("secret"), std::string::npos) << result.errors;
  EXPECT_EQ(run(folder, "plain", "http://a b").exit_code, 2);
  EXPECT_EQ(run(folder, "plain", "http://host/x?y=1").exit_code, 2);
}

}  // namespace
}  // namespace kiln::test
