// A driver that crashes: PoCL with a damaged cache of kernels, or one on a full disk.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <set>
#include <string>
#include <vector>

#include "kiln/bake.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::ProcessOptions;
using test::ProcessResult;

class Crashes : public ::testing::Test {
 protected:
  void SetUp() override {
    KILN_REQUIRE_DEVICE();
    if (test::device()->info().platform != "Portable Computing Language") {
      GTEST_SKIP() << "the cache of kernels is PoCL's";
    }
    folder_ = test::scratch_folder();
    save_obj(test::BumpySphere::dense(500), folder_ / "high.obj");
    save_obj(test::BumpySphere::light(12, 6), folder_ / "low.obj");
  }

  /// \param temporary  where an empty cache may be made
  ProcessResult bake(const fs::path& out, const fs::path& cache, const fs::path& temporary) {
    ProcessOptions options;
    options.environment = {{"POCL_CACHE_DIR", cache}, {"TMPDIR", temporary}};
    return test::run_kiln(words(out), options);
  }

  /// Nearest points of one sample at a time: few kernels, since an empty cache compiles them all.
  std::vector<std::string> words(const fs::path& out) const {
    return {"bake",
            folder_ / "high.obj",
            folder_ / "low.obj",
            "--match",
            "closest",
            "--traversal",
            "gpu",
            "--recall",
            "0",
            "--maps",
            "mask",
            "--size",
            "16",
            "--quiet",
            "--out",
            out};
  }

  /// A map of 2^doublings statements.
  static std::string bomb(int doublings) {
    std::string text = "#define M0 x = x * 1.5f + 0.1f;\n";
    for (int i = 1; i <= doublings; ++i) {
      const std::string last = " M" + std::to_string(i - 1);
      text += "#define M" + std::to_string(i) + last + last + "\n";
    }
    return text + "float4 kiln_map(const kiln_point* p) { float x = p->position.x; M" +
           std::to_string(doublings) + " return (float4)(x); }";
  }

  /// A cache as a good bake leaves it, and that bake's map: kernels are compiled once for all cases.
  struct Filled {
    fs::path cache;
    std::string map;
  };
  const Filled& filled() {
    static const Filled made = [this] {
      const fs::path folder = test::scratch_folder();
      fs::create_directory(folder / "cache");
      const ProcessResult good = bake(folder / "good", folder / "cache", folder);
      EXPECT_EQ(good.exit_code, 0) << good.errors;
      return Filled{folder / "cache", test::read_file(folder / "good" / "low_mask.png")};
    }();
    return made;
  }

  fs::path folder_;
};

TEST_F(Crashes, ADamagedCacheIsLeftForAnEmptyOne) {
  const fs::path cache = folder_ / "cache", temporary = folder_ / "temporary";
  fs::copy(filled().cache, cache, fs::copy_options::recursive);
  fs::create_directory(temporary);
  int damaged = 0;
  for (const auto& entry : fs::recursive_directory_iterator(cache)) {
    if (entry.path().extension() != ".so") continue;
    fs::resize_file(entry.path(), entry.file_size() / 3);
    ++damaged;
  }
  ASSERT_GT(damaged, 0);
  const ProcessResult again = bake(folder_ / "again", cache, temporary);
  EXPECT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_NE(again.errors.find("POCL_CACHE_DIR"), std::string::npos) << again.errors;
  EXPECT_EQ(test::read_file(folder_ / "again" / "low_mask.png"), filled().map);
  EXPECT_TRUE(fs::is_empty(temporary)) << "the empty cache stayed";
  // If there is no place for an empty one, the message says what to do.
  const ProcessResult failed = bake(folder_ / "failed", cache, folder_ / "nowhere");
  EXPECT_EQ(failed.exit_code, 4) << failed.errors;
  EXPECT_NE(failed.errors.find("POCL_CACHE_DIR"), std::string::npos) << failed.errors;
  EXPECT_FALSE(fs::exists(folder_ / "failed" / "low_mask.png"));
}

TEST_F(Crashes, AMissingLinkerIsNamed) {
  ProcessOptions options;
  options.environment = {{"POCL_CACHE_DIR", folder_ / "cache"}, {"PATH", test::path_without("ld")}};
  const ProcessResult result = test::run_kiln(words(folder_ / "out"), options);
  EXPECT_EQ(result.exit_code, 4) << result.errors;
  EXPECT_NE(result.errors.find("'ld', which is not in PATH"), std::string::npos) << result.errors;
  EXPECT_EQ(result.errors.find("Trying"), std::string::npos) << result.errors;
  EXPECT_EQ(result.errors.find("damaged"), std::string::npos) << result.errors;
}

/// Functions of the user's that no driver survives, and one that never returns.
TEST_F(Crashes, OfMapsOfTheUsersAreTold) {
  const auto run = [&](const std::string& body, const char* seconds = "60") {
    std::ofstream(folder_ / "own.cl") << body;
    std::vector<std::string> all = words(folder_ / "out");
    *std::find(all.begin(), all.end(), "mask") = "own=" + (folder_ / "own.cl").string();
    all.insert(all.end(), {"--map-seconds", seconds});
    ProcessOptions options;
    options.timeout_seconds = 300;
    const ProcessResult result = test::run_kiln(all, options);
    EXPECT_EQ(result.exit_code, 3) << result.errors;
    EXPECT_NE(result.errors.find("The map own ('"), std::string::npos) << result.errors;
    EXPECT_EQ(result.errors.find("Trying"), std::string::npos) << result.errors;
    EXPECT_FALSE(fs::exists(folder_ / "out"));
    return result;
  };
  const std::string begin = "float4 kiln_map(const kiln_point* p) { ";
  std::string terms = "float4 kiln_map(const kiln_point* p) { float x = p->position.x; return (x";
  for (int i = 0; i < 200'000; ++i) terms += "+x";
  for (const std::string& body :
       {begin + "volatile float a[4000000]; for (int i = 0; i < 4000000; ++i) a[i] = i; return "
                "(float4)(a[77]); }",
        "float f(float x, int n) { volatile float a[64]; a[n & 63] = x; return n < 0 ? x : f(x + "
        "a[0], n + 1) + a[1]; }\n" +
            begin + "return (float4)(f(p->position.x, 0)); }",
        // Over what the C library and the kernel know of the thread, above its stack.
        begin + "volatile float a[8]; for (int i = 0; i < 100000; ++i) a[i] = i; return "
                "(float4)(a[p->position.x > 5 ? 1 : 0]); }",
  // SIGFPE, on processors that trap.
#ifdef __x86_64__
        begin + "volatile int x = 7, y = p->position.x > 1e20f; return (float4)(x / y); }",
#endif
        begin + "__builtin_debugtrap(); return (float4)(0); }",  // SIGTRAP
        terms + "); }"}) {
    EXPECT_NE(run(body).errors.find("crashed the driver or its compiler"), std::string::npos);
  }
  const ProcessResult endless = run(
      begin + "volatile int x = 1; while (x != 0) x = x == 9 ? 1 : x + 2; return (float4)(x); }",
      "2");
  EXPECT_NE(endless.errors.find("raise --map-seconds"), std::string::npos) << endless.errors;
  // 2^22 statements: the compiler is not waited for.
  const ProcessResult compiled = run(bomb(22), "1");
  EXPECT_NE(compiled.errors.find("is not compiled within 1 s"), std::string::npos)
      << compiled.errors;
  EXPECT_NE(compiled.errors.find("raise --map-seconds"), std::string::npos) << compiled.errors;
}

// PoCL compiles twice, at the build and at the first launch: whichever takes too long, the time of both is the limit's,
// and the map's samples are not blamed.
TEST_F(Crashes, BothCompilationsAreWithinTheTimeOfMaps) {
  for (int doublings = 14; doublings <= 20; doublings += 2) {
    std::ofstream(folder_ / "own.cl") << bomb(doublings);
    std::vector<std::string> all = words(folder_ / "out");
    *std::find(all.begin(), all.end(), "mask") = "own=" + (folder_ / "own.cl").string();
    all.insert(all.end(), {"--map-seconds", "2"});
    ProcessOptions options;
    options.timeout_seconds = 300;
    const ProcessResult result = test::run_kiln(all, options);
    if (result.exit_code == 0) continue;
    EXPECT_EQ(result.exit_code, 3) << result.errors;
    EXPECT_NE(result.errors.find("is not compiled within 2 s"), std::string::npos)
        << doublings << ": " << result.errors;
  }
}

TEST_F(Crashes, NoVariableRemovesAFolder) {
  const fs::path kept = folder_ / "kept", temporary = folder_ / "temporary";
  fs::create_directories(kept / "deep");
  std::ofstream(kept / "deep" / "file") << "text";
  fs::create_directory(temporary);
  ProcessOptions options;
  for (const char* tries : {"1", "2", "3"}) {
    options.environment = {{"KILN_RETRY", tries},
                           {"POCL_CACHE_DIR", kept},
                           {"TMPDIR", temporary},
                           {"KILN_KEEP_BINARIES", "1"}};
    const ProcessResult result = test::run_kiln({"--version"}, options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_EQ(test::read_file(kept / "deep" / "file"), "text");
    EXPECT_TRUE(fs::is_empty(temporary)) << "what it made stayed";
  }
}

TEST_F(Crashes, WithoutAHomeKernelsAreThisUsers) {
  const fs::path temporary = folder_ / "temporary";
  const fs::path user = temporary / ("kiln-" + std::to_string(geteuid()));
  fs::create_directory(temporary);
  ASSERT_EQ(chmod(temporary.c_str(), 01777), 0);
  ProcessOptions options;
  options.environment = {
      {"HOME", ""}, {"XDG_CACHE_HOME", ""}, {"POCL_CACHE_DIR", ""}, {"TMPDIR", temporary}};
  const ProcessResult result = test::run_kiln({"devices"}, options);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_TRUE(fs::exists(user / "kiln")) << result.output;
  ASSERT_EQ(chmod(user.c_str(), 0777), 0);
  const ProcessResult refused = test::run_kiln({"devices"}, options);
  EXPECT_EQ(refused.exit_code, 4) << refused.output;
  EXPECT_NE(refused.errors.find("'" + user.string() + "'"), std::string::npos) << refused.errors;
  options.environment["POCL_CACHE_DIR"] = user;
  const ProcessResult warned = test::run_kiln({"devices"}, options);
  EXPECT_EQ(warned.exit_code, 0) << warned.errors;
  EXPECT_NE(warned.errors.find("warning: "), std::string::npos) << warned.errors;
  EXPECT_NE(warned.errors.find("'" + user.string() + "'"), std::string::npos) << warned.errors;
}

TEST_F(Crashes, ACacheOnAFullDiskIsLeftForAnEmptyOne) {
  const fs::path cache = folder_ / "small", temporary = folder_ / "temporary";
  fs::create_directory(cache);
  fs::create_directory(temporary);
  if (mount("none", cache.c_str(), "tmpfs", 0, "size=100k") != 0) {
    GTEST_SKIP() << "file systems cannot be mounted here";
  }
  const ProcessResult result = bake(folder_ / "out", cache, temporary);
  const ProcessResult failed = bake(folder_ / "failed", cache, folder_ / "nowhere");
  EXPECT_EQ(umount(cache.c_str()), 0);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(result.errors.find("POCL_CACHE_DIR"), std::string::npos) << result.errors;
  EXPECT_TRUE(fs::exists(folder_ / "out" / "low_mask.png"));
  EXPECT_TRUE(fs::is_empty(temporary));
  EXPECT_EQ(failed.exit_code, 4) << failed.errors;
  EXPECT_NE(failed.errors.find("POCL_CACHE_DIR"), std::string::npos) << failed.errors;
}

}  // namespace
}  // namespace kiln
