// kiln bake gives the same bytes every time: on any number of threads, and with every implementation.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/command_scene.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/process.h"
#include "support/read_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::make_scene;
using test::ProcessOptions;
using test::ProcessResult;
using test::read_json;
using test::run_kiln;

TEST(Command, GivesTheSameBytesEveryTime) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto bake = [&](const std::string& name, const std::vector<std::string>& more,
                        const ProcessOptions& options) {
    std::vector<std::string> arguments = {"bake",  scene / "high.obj", scene / "low.obj",
                                          "--out", scene / name,       "--size",
                                          "300",   "--max-distance",   "10%"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = run_kiln(arguments, options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return test::read_file(scene / name / "low_normal.png");
  };
  const std::string expected = bake("a", {}, {});
  ASSERT_GT(expected.size(), 1000U);
  EXPECT_TRUE(bake("b", {}, {}) == expected) << "run twice";
  ProcessOptions one_thread;
  one_thread.environment = {{"KILN_THREADS", "1"}, {"POCL_MAX_PTHREAD_COUNT", "1"}};
  EXPECT_TRUE(bake("c", {"--traversal", "gpu"}, one_thread) == expected) << "one thread, gpu";
  EXPECT_TRUE(bake("d", {"--traversal", "cpu"}, one_thread) == expected) << "one thread, cpu";
}

TEST(Command, VisibilityGivesTheSameBytesEveryTime) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(6000);
  {
    std::ofstream file(scene / "views.txt");
    file << "# where visitors stand\n1 0.2 0 1\n\n0 0.2 1 2.5 # the entrance\n0 -1 0 0\n";
  }
  const auto bake = [&](const std::vector<std::string>& more, const ProcessOptions& options) {
    std::vector<std::string> arguments = {"bake",
                                          scene / "high.obj",
                                          scene / "low.obj",
                                          "--out",
                                          scene / "out",
                                          "--size",
                                          "64",
                                          "--max-distance",
                                          "10%",
                                          "--directions",
                                          "24",
                                          "--recall",
                                          "0",
                                          "--json",
                                          scene / "report.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = run_kiln(arguments, options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return test::read_file(scene / "out" / "low_normal.png");
  };
  ProcessOptions one_thread;
  one_thread.environment = {{"KILN_THREADS", "1"}, {"POCL_MAX_PTHREAD_COUNT", "1"}};
  ProcessOptions three_threads;
  three_threads.environment = {{"KILN_THREADS", "3"}};
  std::vector<std::string> all;
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--match", "visibility"},
        {"--match", "visibility", "--visibility-at", "vertex"},
        {"--match", "visibility", "--visibility-at", "vertex", "--visibility-test", "rays"},
        {"--match", "visibility", "--visibility-at", "face"},
        {"--match", "visibility", "--visibility-test", "rays", "--samples", "2"},
        {"--match", "hybrid", "--visibility-smooth", "9"},
        {"--match", "visibility", "--view-weight", "horizon"},
        {"--match", "visibility", "--view-weight", scene / "views.txt"}}) {
    const std::string expected = bake(options, three_threads);
    ASSERT_GT(expected.size(), 1000U);
    std::vector<std::string> gpu = options;
    gpu.insert(gpu.end(), {"--traversal", "gpu"});
    EXPECT_TRUE(bake(gpu, one_thread) == expected) << options.back() << ", one thread, gpu";
    EXPECT_EQ(std::count(all.begin(), all.end(), expected), 0) << options.back();
    all.push_back(expected);
    const nlohmann::json report = read_json(scene / "report.json");
    EXPECT_EQ(report["options"]["match"], options[1]);
    EXPECT_EQ(report["options"]["directions"], 24);
    const auto& visibility = report["visibility"];
    EXPECT_GT(visibility["places"].get<int>(), 1000);
    EXPECT_GT(visibility["seconds"].get<double>(), 0);
    EXPECT_EQ(visibility["test"], report["options"]["visibility_test"]);
    EXPECT_LE(visibility["directions"].get<int>(), 24);
  }
  // In words, too.
  const ProcessResult said =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "out", "--size",
                "16", "--match", "hybrid", "--fallback", "mark", "--max-distance", "0.1%"});
  EXPECT_NE((said.output + said.errors).find("visibility from 512 directions"), std::string::npos)
      << said.output << said.errors;
}

TEST(Command, GivesTheSameBytesOnOtherImplementations) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();  // Oclgrind takes long for each triangle.
  save_obj(test::BumpySphere::dense(400), scene / "high.obj");
  save_obj(test::BumpySphere::light(16, 8), scene / "low.obj");
  const auto bake = [&](const std::string& name, const std::string& launcher,
                        const std::vector<std::string>& more, const ProcessOptions& options) {
    std::vector<std::string> command = {test::kiln_command(),
                                        "bake",
                                        scene / "high.obj",
                                        scene / "low.obj",
                                        "--out",
                                        scene / name,
                                        "--size",
                                        "24",
                                        "--max-distance",
                                        "10%",
                                        "--samples",
                                        "2",
                                        "--recall",  // 8,192 places take Oclgrind half a minute
                                        "0"};
    command.insert(command.end(), more.begin(), more.end());
    if (!launcher.empty()) command.insert(command.begin(), launcher);
    const ProcessResult result = test::run_process(command, options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return test::read_file(scene / name / "low_normal.png");
  };
  const std::string expected = bake("here", "", {}, {});
  ASSERT_GT(expected.size(), 1000U);
#ifdef __SANITIZE_ADDRESS__
  const bool oclgrind = false;  // it is preloaded, and the sanitizer wants to come first
#else
  const bool oclgrind = fs::exists("/usr/bin/oclgrind");
#endif
  const fs::path rusticl = "/etc/OpenCL/vendors/rusticl.icd";
  if (oclgrind) {
    EXPECT_TRUE(bake("oclgrind", "/usr/bin/oclgrind", {}, {}) == expected) << "Oclgrind";
  } else if (fs::exists(rusticl)) {
    // Second, since it compiles a ray alone in 11 processor seconds with a cold cache; tools/gates drivers bakes 28
    // cases with it.
    ProcessOptions options;
    options.environment = {{"OCL_ICD_VENDORS", rusticl}, {"RUSTICL_ENABLE", "llvmpipe"}};
    options.timeout_seconds = 400;
    EXPECT_TRUE(bake("rusticl", "", {"--traversal", "gpu"}, options) == expected) << "rusticl";
  } else {
    GTEST_SKIP() << "no second OpenCL implementation is installed";
  }
}

}  // namespace
}  // namespace kiln
