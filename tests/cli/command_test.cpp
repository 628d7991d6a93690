// The command as its users meet it: exit codes, messages, files, the report.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

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

/// Writes a scene of a bumpy sphere and its low poly; returns the folder.
fs::path make_scene(std::uint32_t faces = 20000) {
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(faces), folder / "high.obj");
  save_obj(test::BumpySphere::light(), folder / "low.obj");
  return folder;
}

std::vector<std::string> names(const fs::path& folder) {
  std::vector<std::string> result;
  if (!fs::exists(folder)) return result;  // made for nothing, so gone
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with(".") || !name.ends_with(".kiln.json")) result.push_back(name);
  }
  std::sort(result.begin(), result.end());
  return result;
}

nlohmann::json read_json(const fs::path& path) {
  std::ifstream stream(path);
  return nlohmann::json::parse(stream);
}

/// Expects a failure with this code, one message that has all of `words`, and nothing in the folder.
void expect_failure(const std::vector<std::string>& arguments, int code,
                    const std::vector<std::string>& words, const fs::path& out = {}) {
  const ProcessResult result = run_kiln(arguments);
  EXPECT_EQ(result.exit_code, code) << result.errors;
  for (const std::string& word : words) {
    EXPECT_NE(result.errors.find(word), std::string::npos)
        << "'" << word << "' in: " << result.errors;
  }
  std::size_t messages = 0;
  for (std::size_t at = 0; (at = result.errors.find("kiln: ", at)) != std::string::npos; ++at)
    ++messages;
  EXPECT_EQ(messages, 1U) << result.errors;
  if (!out.empty() && fs::exists(out)) {
    EXPECT_TRUE(names(out).empty()) << names(out)[0];
  }
}

TEST(Command, BakesTheContractsFilesAndReport) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const fs::path out = scene / "out";
  const ProcessResult result =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", out, "--size", "256x128",
                "--max-distance", "10%", "--json", scene / "report.json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(names(out), std::vector<std::string>{"low_normal.png"});
  const Image map = load_image(out / "low_normal.png");
  EXPECT_EQ(map.width, 256U);
  EXPECT_EQ(map.height, 128U);

  const nlohmann::json report = read_json(scene / "report.json");
  for (const char* key : {"version", "device", "inputs", "options", "seconds", "texels", "warnings",
                          "memory", "outputs"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  double stages = 0;
  for (const char* key : {"load", "low", "build", "texels", "match", "detail", "image", "save"}) {
    ASSERT_TRUE(report["seconds"].contains(key)) << key;
    stages += report["seconds"][key].get<double>();
  }
  EXPECT_LE(stages, report["seconds"]["total"].get<double>() * 1.001);
  const auto& texels = report["texels"];
  EXPECT_EQ(texels["samples"].get<std::uint64_t>(),
            texels["outward"].get<std::uint64_t>() + texels["inward"].get<std::uint64_t>() +
                texels["cage"].get<std::uint64_t>() + texels["missed"].get<std::uint64_t>());
  EXPECT_GT(texels["covered"].get<std::uint64_t>(), 20000U);
  EXPECT_EQ(report["inputs"]["low"]["triangles"], test::BumpySphere::light().triangles.size());
  EXPECT_EQ(report["options"]["max_distance"], "10%");
}

TEST(Command, WritesMipMapsInEveryFormat) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  for (const std::string format : {"png8", "png16", "exr", "exr32"}) {
    std::map<std::string, std::string> bytes;
    for (const std::string threads : {"1", "2"}) {
      const fs::path out = scene / (format + threads);
      const ProcessResult result =
          run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", out, "--size", "70x33",
                    "--max-distance", "10%", "--mips", "--format", format, "--two-component",
                    "--samples", "2", "--json", scene / "report.json"},
                   {.environment = {{"KILN_THREADS", threads}}});
      ASSERT_EQ(result.exit_code, 0) << result.errors;
      const bool png = format.starts_with("png");
      std::vector<std::string> expected = {png ? "low_normal.png" : "low_normal.exr"};
      for (int level = 1; png && level <= 6; ++level) {
        expected.push_back("low_normal.mip0" + std::to_string(level) + ".png");
      }
      const nlohmann::json report = read_json(scene / "report.json");
      std::vector<std::string> outputs;
      for (const auto& path : report["outputs"]) {
        outputs.push_back(fs::path(path.get<std::string>()).filename());
      }
      EXPECT_EQ(outputs, expected);
      std::sort(expected.begin(), expected.end());
      EXPECT_EQ(names(out), expected);
      EXPECT_EQ(report["options"]["mips"], true);
      const auto& levels = report["mips"]["normal"];
      ASSERT_EQ(levels.size(), 7U);
      for (std::size_t level = 0; level < levels.size(); ++level) {
        const Image image = load_image(levels[level]["file"].get<std::string>());
        EXPECT_EQ(levels[level]["width"], std::max(70 >> level, 1));
        EXPECT_EQ(levels[level]["height"], std::max(33 >> level, 1));
        EXPECT_EQ(image.width, png ? std::max(70U >> level, 1U) : 70U);
      }
      for (const std::string& name : expected) {
        std::ifstream file(out / name, std::ios::binary);
        const std::string now{std::istreambuf_iterator<char>(file), {}};
        const auto [known, first] = bytes.emplace(name, now);
        EXPECT_TRUE(first || known->second == now) << name;
      }
    }
  }
  // A map of one texel has no levels below.
  const ProcessResult one =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "one", "--size",
                "1", "--mips", "--max-distance", "10%"});
  ASSERT_EQ(one.exit_code, 0) << one.errors;
  EXPECT_EQ(names(scene / "one"), std::vector<std::string>{"low_normal.png"});
}

TEST(Command, MakesTheLightMeshWhereNoneIsGiven) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const fs::path out = scene / "out";
  const ProcessResult result =
      run_kiln({"bake", scene / "high.obj", "--out", out, "--size", "512", "--faces", "500"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(names(out), (std::vector<std::string>{"high_low.obj", "high_low_normal.png"}));
  const Mesh low = load_mesh(out / "high_low.obj");
  EXPECT_NEAR(static_cast<double>(low.triangles.size()), 500, 10);
  EXPECT_EQ(low.uv_triangles.size(), low.triangles.size());
}

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
    std::ifstream file(scene / name / "low_normal.png", std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string expected = bake("a", {}, {});
  ASSERT_GT(expected.size(), 1000U);
  EXPECT_TRUE(bake("b", {}, {}) == expected) << "run twice";
  ProcessOptions one_thread;
  one_thread.environment = {{"KILN_THREADS", "1"}, {"POCL_MAX_PTHREAD_COUNT", "1"}};
  EXPECT_TRUE(bake("c", {}, one_thread) == expected) << "one thread";
  EXPECT_TRUE(bake("d", {"--traversal", "gpu"}, {}) == expected) << "the other traversal";
  EXPECT_TRUE(bake("e", {"--traversal", "cpu"}, one_thread) == expected);
}

TEST(Command, VisibilityGivesTheSameBytesEveryTime) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
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
                                          "200",
                                          "--max-distance",
                                          "10%",
                                          "--directions",
                                          "96",
                                          "--json",
                                          scene / "report.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = run_kiln(arguments, options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    std::ifstream file(scene / "out" / "low_normal.png", std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  ProcessOptions one_thread;
  one_thread.environment = {{"KILN_THREADS", "1"}, {"POCL_MAX_PTHREAD_COUNT", "1"}};
  ProcessOptions three_threads;
  three_threads.environment = {{"KILN_THREADS", "3"}};
  std::vector<std::string> all;
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--match", "visibility"},
        {"--match", "visibility", "--visibility-at", "vertex"},
        {"--match", "visibility", "--visibility-at", "vertex", "--visibility-test", "views"},
        {"--match", "visibility", "--visibility-at", "face"},
        {"--match", "visibility", "--visibility-test", "rays", "--samples", "2"},
        {"--match", "hybrid", "--visibility-smooth", "9"},
        {"--match", "visibility", "--view-weight", "horizon"},
        {"--match", "visibility", "--view-weight", scene / "views.txt"}}) {
    const std::string expected = bake(options, {});
    ASSERT_GT(expected.size(), 1000U);
    EXPECT_TRUE(bake(options, one_thread) == expected) << options.back();
    EXPECT_TRUE(bake(options, three_threads) == expected) << options.back();
    std::vector<std::string> gpu = options;
    gpu.insert(gpu.end(), {"--traversal", "gpu"});
    EXPECT_TRUE(bake(gpu, {}) == expected) << options.back();
    EXPECT_EQ(std::count(all.begin(), all.end(), expected), 0) << options.back();
    all.push_back(expected);
    const nlohmann::json report = read_json(scene / "report.json");
    EXPECT_EQ(report["options"]["match"], options[1]);
    EXPECT_EQ(report["options"]["directions"], 96);
    const auto& visibility = report["visibility"];
    EXPECT_GT(visibility["places"].get<int>(), 1000);
    EXPECT_GT(visibility["seconds"].get<double>(), 0);
    EXPECT_EQ(visibility["test"], report["options"]["visibility_test"]);
    EXPECT_LE(visibility["directions"].get<int>(), 96);
  }
  // In words, too.
  const ProcessResult said =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "out", "--size",
                "64", "--match", "hybrid", "--fallback", "mark", "--max-distance", "0.1%"});
  EXPECT_NE((said.output + said.errors).find("visibility from 512 directions"), std::string::npos)
      << said.output << said.errors;
}

TEST(Command, NamesTheLineOfABadListOfViews) {
  const fs::path scene = make_scene(500);
  for (const auto& [text, line] :
       {std::pair{"0 0 1 1\n0 0 0 1\n", "line 2"}, std::pair{"1 2 3\n", "line 1"},
        std::pair{"1 2 3 -4\n", "line 1"}, std::pair{"1 2 3 4 5\n", "line 1"},
        std::pair{"\n# nothing\n", "no line"}}) {
    std::ofstream(scene / "views.txt") << text;
    expect_failure({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "out",
                    "--match", "hybrid", "--view-weight", scene / "views.txt"},
                   3, {"views.txt", line}, scene / "out");
  }
  // Sums of large weights stay in range, and a list that says nothing is remarked.
  std::ofstream(scene / "views.txt") << "0 0 1 1e38\n0 1 0 1e38\n";
  const ProcessResult equal =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--size", "64", "--out",
                scene / "equal", "--match", "visibility", "--view-weight", scene / "views.txt"});
  EXPECT_EQ(equal.exit_code, 0) << equal.errors;
  EXPECT_NE(equal.errors.find("same weight"), std::string::npos) << equal.errors;
  EXPECT_EQ((equal.output + equal.errors).find("standard deviation 0.000"), std::string::npos);
}

TEST(Command, GivesTheSameBytesOnOtherImplementations) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const auto bake = [&](const std::string& name, const std::string& launcher,
                        const ProcessOptions& options) {
    std::vector<std::string> command = {test::kiln_command(),
                                        "bake",
                                        scene / "high.obj",
                                        scene / "low.obj",
                                        "--out",
                                        scene / name,
                                        "--size",
                                        "48",
                                        "--max-distance",
                                        "10%",
                                        "--samples",
                                        "2"};
    if (!launcher.empty()) command.insert(command.begin(), launcher);
    const ProcessResult result = test::run_process(command, options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    std::ifstream file(scene / name / "low_normal.png", std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string expected = bake("here", "", {});
  ASSERT_GT(expected.size(), 1000U);
  bool any = false;
  const fs::path rusticl = "/etc/OpenCL/vendors/rusticl.icd";
  if (fs::exists(rusticl)) {
    any = true;
    ProcessOptions options;
    options.environment = {{"OCL_ICD_VENDORS", rusticl}, {"RUSTICL_ENABLE", "llvmpipe"}};
    options.timeout_seconds = 400;  // it compiles for long where its cache is cold
    EXPECT_TRUE(bake("rusticl", "", options) == expected) << "rusticl";
  }
#ifdef __SANITIZE_ADDRESS__
  const bool oclgrind = false;  // it is preloaded, and the sanitizer wants to come first
#else
  const bool oclgrind = fs::exists("/usr/bin/oclgrind");
#endif
  if (oclgrind) {
    any = true;
    EXPECT_TRUE(bake("oclgrind", "/usr/bin/oclgrind", {}) == expected) << "Oclgrind";
  }
  if (!any) GTEST_SKIP() << "no second OpenCL implementation is installed";
}

TEST(Command, WritesAMapForEachClusterOfDirections) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const std::vector<std::string> base = {"bake",
                                         scene / "high.obj",
                                         scene / "low.obj",
                                         "--size",
                                         "64",
                                         "--max-distance",
                                         "10%",
                                         "--out",
                                         scene / "clusters",
                                         "--json",
                                         scene / "report.json",
                                         "--visibility-clusters",
                                         "2"};
  std::vector<std::string> by_rays = base;
  EXPECT_EQ(run_kiln(by_rays).exit_code, 2);
  std::vector<std::string> good = base;
  good.insert(good.end(), {"--match", "visibility", "--visibility-deviation", "0.5"});
  const ProcessResult result = run_kiln(good);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(names(scene / "clusters"),
            (std::vector<std::string>{"low_clusters.exr", "low_normal.png", "low_normal_1.png"}));
  // The first layer that has X Y Z.
  const Image directions = load_image(scene / "clusters/low_clusters.exr");
  EXPECT_EQ(directions.width, 64U);
  EXPECT_EQ(directions.channels, 3U);
  std::size_t unit = 0;
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    const float* p = &directions.pixels[3 * i];
    const float squared = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    EXPECT_TRUE(squared == 0 || std::abs(squared - 1) < 1e-5F) << i;
    unit += squared != 0 ? 1 : 0;
  }
  const nlohmann::json report = read_json(scene / "report.json");
  EXPECT_EQ(report["visibility"]["places"], unit);
  EXPECT_GT(report["visibility"]["clustered"].get<std::size_t>(), unit / 2);
  EXPECT_EQ(report["options"]["visibility_clusters"], 2);
}

TEST(Command, BlendsWithTheFallback) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  std::vector<std::string> command = {"bake",
                                      scene / "high.obj",
                                      scene / "low.obj",
                                      "--size",
                                      "64",
                                      "--out",
                                      scene / "blended",
                                      "--json",
                                      scene / "report.json",
                                      "--max-distance",
                                      "2%",
                                      "--fallback-blend",
                                      "4"};
  EXPECT_EQ(run_kiln(command).exit_code, 2);
  command.insert(command.end(), {"--fallback", "closest"});
  const ProcessResult result = run_kiln(command);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report = read_json(scene / "report.json");
  EXPECT_EQ(report["switches"]["sides"], report["switches_blended"]["sides"]);
  EXPECT_TRUE(report["switches_blended"].contains("blended_texels"));
}

TEST(Command, SavedMatchBakesTheSameMap) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const std::vector<std::string> base = {
      "bake", scene / "high.obj", scene / "low.obj", "--size", "200", "--samples", "2"};
  std::vector<std::string> first = base;
  first.insert(first.end(), {"--out", scene / "a", "--save-match", scene / "match.exr",
                             "--max-distance", "10%"});
  ASSERT_EQ(run_kiln(first).exit_code, 0);
  std::vector<std::string> second = base;
  second.insert(second.end(), {"--out", scene / "b", "--load-match", scene / "match.exr"});
  ASSERT_EQ(run_kiln(second).exit_code, 0);
  EXPECT_EQ(run_kiln({"diff", scene / "a/low_normal.png", scene / "b/low_normal.png"}).exit_code,
            0);

  std::vector<std::string> wrong = {
      "bake",  scene / "high.obj", scene / "low.obj", "--size",           "100",
      "--out", scene / "c",        "--load-match",    scene / "match.exr"};
  expect_failure(wrong, 3, {"match", "200"}, scene / "c");
}

TEST(Command, DiffTellsWithinFromBeyond) {
  const fs::path folder = test::scratch_folder();
  Image a{8, 8, 3, std::vector<float>(192, 0.5F)};
  for (std::size_t i = 2; i < a.pixels.size(); i += 3) a.pixels[i] = 1;
  Image b = a;
  b.at(3, 4)[0] = 0.6F;  // 2 * 0.1 over 1: atan(0.2) = 11.3 degrees
  save_image(a, folder / "a.png", {ImageFormat::png16});
  save_image(b, folder / "b.png", {ImageFormat::png16});
  EXPECT_EQ(run_kiln({"diff", folder / "a.png", folder / "a.png"}).exit_code, 0);
  EXPECT_EQ(run_kiln({"diff", folder / "a.png", folder / "b.png"}).exit_code, 1);
  EXPECT_EQ(run_kiln({"diff", folder / "a.png", folder / "b.png", "--max-angle", "11.4"}).exit_code,
            0);
  EXPECT_EQ(run_kiln({"diff", folder / "a.png", folder / "b.png", "--max-angle", "11.2"}).exit_code,
            1);
  EXPECT_EQ(run_kiln({"diff", folder / "a.png", folder / "b.png", "--max-error", "0.11"}).exit_code,
            0);
  EXPECT_EQ(
      run_kiln({"diff", folder / "a.png", folder / "b.png", "--max-mean-angle", "0.1"}).exit_code,
      1);
  EXPECT_EQ(run_kiln({"diff", folder / "a.png", folder / "b.png", "--max-mean-angle", "0.2",
                      "--json", folder / "d.json"})
                .exit_code,
            0);
  const nlohmann::json report = read_json(folder / "d.json");
  EXPECT_NEAR(report["max_angle_degrees"].get<double>(), 11.31, 0.01);
  EXPECT_EQ(report["worst"], (std::vector<int>{3, 4}));
  expect_failure({"diff", folder / "a.png", folder / "none.png"}, 3, {"none.png"});
}

TEST(Command, RefusesBadUsage) {
  const fs::path scene = make_scene(500);
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  const fs::path out = scene / "out";
  const auto bake = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"bake", high, low, "--out", out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  expect_failure({}, 2, {"help"});
  expect_failure({"fry"}, 2, {"fry"});
  expect_failure({"bake"}, 2, {"HIGH"});
  expect_failure({"bake", high, low}, 2, {"--out"});
  expect_failure(bake({"--size", "0"}), 2, {"--size", "16384"}, out);
  expect_failure(bake({"--size", "100000"}), 2, {"--size", "16384"}, out);
  expect_failure(bake({"--size", "12x"}), 2, {"--size"}, out);
  expect_failure(bake({"--size", "-5"}), 2, {"--size"}, out);
  expect_failure(bake({"--maps", "normal,smell"}), 2, {"smell", "normal"}, out);
  expect_failure(bake({"--curvature-radius", "1%"}), 2, {"--curvature-radius", "--maps"}, out);
  expect_failure(bake({"--maps", "curvature", "--curvature-radius", "0"}), 2,
                 {"--curvature-radius"}, out);
  expect_failure(bake({"--match", "guess"}), 2, {"guess", "ray"}, out);
  expect_failure(bake({"--max-distance", "0"}), 2, {"--max-distance"}, out);
  expect_failure(bake({"--max-distance", "nan"}), 2, {"--max-distance"}, out);
  expect_failure(bake({"--max-distance", "-1%"}), 2, {"--max-distance"}, out);
  expect_failure(bake({"--samples", "0"}), 2, {"--samples"}, out);
  expect_failure(bake({"--samples", "17"}), 2, {"--samples"}, out);
  expect_failure(bake({"--gutter", "wide"}), 2, {"--gutter", "inf"}, out);
  expect_failure(bake({"--raw"}), 2, {"--raw", "exr"}, out);
  expect_failure(bake({"--dither"}), 2, {"--dither", "png8"}, out);
  expect_failure(bake({"--faces", "100"}), 2, {"--faces", "LOW"}, out);
  expect_failure(bake({"--cage", "1%", "--cage-mesh", low}), 2, {"--cage"}, out);
  expect_failure(bake({"--save-match", "a.exr", "--load-match", "a.exr"}), 2, {"--load-match"},
                 out);
  expect_failure(bake({"--space", "object", "--two-component"}), 2, {"two-component"}, out);
  expect_failure({"bake", high, "--out", out, "--unwrap"}, 2, {"--unwrap"}, out);
  expect_failure({"bake", high, "--out", out, "--faces", "0"}, 2, {"--faces"}, out);
  expect_failure({"bake", high, "", "--out", out}, 2, {"LOW"}, out);
  expect_failure(bake({"--max-error", "nan"}), 2, {"--max-error"}, out);
  expect_failure(bake({"--max-angle", "2"}), 2, {"--max-angle", "--match auto"}, out);
  expect_failure(bake({"--match", "auto", "--max-angle", "2%"}), 2, {"--max-angle"}, out);
  expect_failure(bake({"--views", "12"}), 2, {"--match views"}, out);
  expect_failure(bake({"--match", "views", "--views", "many"}), 2, {"--views", "auto"}, out);
  expect_failure(bake({"--match", "views", "--view", "0,0,0"}), 2, {"--view"}, out);
  expect_failure(bake({"--match", "views", "--cage", "2%"}), 2, {"--fallback ray"}, out);
  expect_failure(bake({"--match", "closest", "--cage", "2%"}), 2, {"--fallback ray"}, out);
  expect_failure(bake({"--match", "nearest"}), 2, {"--match", "closest"}, out);
  expect_failure(bake({"--fallback", "uv"}), 2, {"--fallback", "closest"}, out);
  expect_failure(bake({"--fallback", "fill", "--miss", "mark"}), 2, {"--fallback fill", "--miss"},
                 out);
  expect_failure(bake({"--match", "views", "--fallback", "views"}), 2, {"undecided"}, out);
  expect_failure(bake({"--directions", "100"}), 2, {"--directions", "--match visibility"}, out);
  expect_failure(bake({"--match", "hybrid", "--directions", "0"}), 2, {"--directions", "4096"},
                 out);
  expect_failure(bake({"--match", "visibility", "--visibility-at", "edge"}), 2,
                 {"--visibility-at", "texel"}, out);
  expect_failure(bake({"--match", "visibility", "--view-weight", "nowhere.txt"}), 3,
                 {"nowhere.txt", "horizon"}, out);
  expect_failure(bake({"--match", "visibility", "--cage", "2%"}), 2, {"--fallback ray"}, out);
  expect_failure(bake({"--fallback", "ray"}), 2, {"--fallback ray", "undecided"}, out);
  expect_failure(bake({"--match", "closest", "--fallback", "closest"}), 2,
                 {"--fallback closest", "undecided"}, out);
  expect_failure(bake({"--load-match", "a.exr", "--match", "closest"}), 2, {"--match"}, out);
  expect_failure(bake({"--match", "visibility", "--visibility-deviation", "0.5"}), 2,
                 {"--visibility-clusters"}, out);
  expect_failure(
      bake({"--match", "visibility", "--visibility-at", "vertex", "--visibility-smooth", "9"}), 2,
      {"--visibility-smooth"}, out);
  expect_failure(
      bake({"--match", "visibility", "--visibility-test", "rays", "--visibility-size", "64"}), 2,
      {"--visibility-size"}, out);
  expect_failure(bake({"--load-match", "a.exr", "--fallback", "closest"}), 2, {"--load-match"},
                 out);
  expect_failure({"simplify", high, "--out", scene / "low.ply"}, 2, {".obj"});
}

TEST(Command, NamesTheFileAndTheRemedyForBadInput) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(500);
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  const fs::path out = scene / "out";
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(scene / name, std::ios::binary) << text;
    return (scene / name).string();
  };
  const auto expect_bad_high = [&](const std::string& path, const std::vector<std::string>& words) {
    expect_failure({"bake", path, low, "--out", out}, 3, words, out);
  };
  expect_bad_high(scene / "none.ply", {"none.ply"});
  expect_bad_high(scene, {scene.filename()});
  expect_bad_high(write("empty.ply", ""), {"empty.ply", "empty"});
  expect_bad_high(write("a.xyz", "1 2 3"), {"a.xyz", ".obj"});
  expect_bad_high(write("garbage.ply", std::string(2000, '\x93')), {"garbage.ply"});
  expect_bad_high(write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), {"points.obj", "face"});
  expect_bad_high(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), {"flat"});
  expect_bad_high(write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), {"range.obj", "9"});
  expect_bad_high(write("nan.obj", "v nan 0 0\nv nan 0 0\nv 0 nan 0\nf 1 2 3\n"), {"nan"});

  // The low poly.
  const std::string plain = write("plain.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expect_failure({"bake", high, plain, "--out", out}, 3, {"plain", "UV", "--unwrap"}, out);
  const std::string zero =
      write("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 0 0\nvt 0 0\nf 1/1 2/2 3/3\n");
  expect_failure({"bake", high, zero, "--out", out}, 3, {"zero", "UV"}, out);
  expect_failure({"bake", high, low, "--out", out, "--cage-mesh", plain}, 3, {"cage"}, out);
  expect_failure({"bake", high, low, "--out", out, "--load-match", plain}, 3, {"plain.obj"}, out);
}

TEST(Command, SuggestsTheOptionThatWasMeant) {
  const ProcessResult typo = run_kiln({"bake", "a", "b", "--out", "c", "--sise", "64"});
  EXPECT_EQ(typo.exit_code, 2);
  EXPECT_NE(typo.errors.find("'--sise'"), std::string::npos) << typo.errors;
  EXPECT_NE(typo.errors.find("--size?"), std::string::npos) << typo.errors;
  const ProcessResult help = run_kiln({"help", "bake"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.output.find("--max-distance"), std::string::npos);
}

TEST(Command, CageTakesRaysTwiceAsLongWhereNoneAreGiven) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto missed = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"bake",  scene / "high.obj", scene / "low.obj",
                                          "--out", scene / "out",      "--size",
                                          "128",   "--json",           scene / "r.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = run_kiln(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const nlohmann::json report = read_json(scene / "r.json");
    return std::pair{report["texels"]["missed"].get<std::uint64_t>(), result.errors};
  };
  EXPECT_EQ(missed({"--cage", "4%"}).first, 0U);
  EXPECT_EQ(missed({"--cage", "6%"}).first, 0U);
  const auto [count, errors] = missed({"--cage", "4%", "--max-distance", "3.5%"});
  EXPECT_GT(count, 0U);
  EXPECT_NE(errors.find("twice --cage"), std::string::npos) << errors;
}

TEST(Command, AnEmptyResultIsAnErrorThatSaysWhy) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const auto expect = [&](const std::string& name, const std::function<void(Mesh&)>& change,
                          const std::string& word) {
    Mesh low = test::BumpySphere::light();
    change(low);
    save_obj(low, scene / (name + ".obj"));
    expect_failure({"bake", scene / "high.obj", scene / (name + ".obj"), "--out", scene / "out",
                    "--size", "64"},
                   3, {name, word}, scene / "out");
  };
  expect(
      "large",
      [](Mesh& m) {
        for (Vec3& p : m.positions) p = {p.x * 100, p.y * 100, p.z * 100};
      },
      "times as large");
  expect(
      "away",
      [](Mesh& m) {
        for (Vec3& p : m.positions) p.x += 10;
      },
      "units away");
  expect(
      "outside",
      [](Mesh& m) {
        for (Vec2& uv : m.uvs) uv.x += 2;
      },
      "unit square");
}

TEST(Command, MissesBeyondTheLimitFail) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const std::vector<std::string> arguments = {"bake",        scene / "high.obj", scene / "low.obj",
                                              "--out",       scene / "out",      "--size",
                                              "64",          "--max-distance",   "0.5%",
                                              "--max-missed"};
  const auto with = [&](const std::string& limit) {
    std::vector<std::string> all = arguments;
    all.push_back(limit);
    return run_kiln(all).exit_code;
  };
  EXPECT_EQ(with("99.9"), 0);
  EXPECT_EQ(with("1"), 1);
  EXPECT_EQ(with("101"), 2);
}

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

TEST(Command, ASavedMatchBelongsToItsMeshes) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const std::string match = scene / "match.exr";
  const auto bake = [&](const std::string& low, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"bake",        scene / "high.obj", low, "--out",
                                          scene / "out", "--size",           "64"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  ASSERT_EQ(
      run_kiln(bake(scene / "low.obj", {"--save-match", match, "--max-distance", "10%"})).exit_code,
      0);
  EXPECT_EQ(run_kiln(bake(scene / "low.obj", {"--load-match", match})).exit_code, 0);
  Mesh other = test::BumpySphere::light();
  other.positions[5].x += 0.001F;
  save_obj(other, scene / "other.obj");
  expect_failure(bake(scene / "other.obj", {"--load-match", match}), 3, {"another low poly"});
}

TEST(Command, ReadsItsOwnFormsOfMapsAndMasks) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(20000);
  const auto bake = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"bake",
                                          scene / "high.obj",
                                          scene / "low.obj",
                                          "--out",
                                          scene / name,
                                          "--size",
                                          "128",
                                          "--max-distance",
                                          "10%",
                                          "--format",
                                          "exr32"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ASSERT_EQ(run_kiln(arguments).exit_code, 0);
  };
  bake("plain", {"--maps", "normal,mask", "--save-match", scene / "match.exr"});
  bake("raw", {"--raw"});
  bake("two", {"--two-component"});
  bake("both", {"--raw", "--two-component"});
  bake("gutterless", {"--gutter", "0"});
  const std::string plain = scene / "plain/low_normal.exr";
  for (const char* name : {"raw", "two", "both"}) {
    EXPECT_EQ(
        run_kiln({"diff", plain, scene / name / "low_normal.exr", "--max-angle", "0.05"}).exit_code,
        0)
        << name;
  }
  const std::string gutterless = scene / "gutterless/low_normal.exr";
  EXPECT_EQ(run_kiln({"diff", plain, gutterless}).exit_code, 1);
  EXPECT_EQ(run_kiln({"diff", plain, gutterless, "--mask", scene / "plain/low_mask.exr"}).exit_code,
            0);
  EXPECT_EQ(run_kiln({"diff", plain, gutterless, "--mask", scene / "match.exr"}).exit_code, 0);
  const ProcessResult json = run_kiln({"diff", plain, plain, "--json", "-"});
  EXPECT_EQ(nlohmann::json::parse(json.output)["within"], true);
}

TEST(Command, DiffPassesNothingThatItDidNotCompare) {
  const fs::path folder = test::scratch_folder();
  const auto flat = [](std::uint32_t channels, float value) {
    return Image{4, 4, channels, std::vector<float>(std::size_t{16} * channels, value)};
  };
  save_image(flat(1, 0.2F), folder / "grey.png", {ImageFormat::png16});
  save_image(flat(3, 0.7F), folder / "a.png", {ImageFormat::png16});
  save_image(flat(3, 0.2F), folder / "b.png", {ImageFormat::png16});
  save_image(flat(1, 0), folder / "none.png", {ImageFormat::png16});
  const std::string a = folder / "a.png", b = folder / "b.png", grey = folder / "grey.png";
  expect_failure({"diff", grey, grey, "--max-angle", "0"}, 2, {"--max-error"});
  expect_failure({"diff", a, b, "--max-angle", "nan"}, 2, {"nan"});
  expect_failure({"diff", a, b, "--max-error", "-1"}, 2, {"'-1'"});
  expect_failure({"diff", a, b, "--mask", folder / "none.png"}, 3, {"none.png"});
  expect_failure({"diff", a, grey}, 3, {"channels"});
  expect_failure({"diff", a, b, "--mask", ""}, 2, {"--mask"});
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
  for (const double delay : {0.05, 0.4, 1.0, 2.0}) {
    const fs::path out = scene / ("out" + std::to_string(delay));
    ProcessOptions options;
    options.interrupt_after_seconds = delay;
    const ProcessResult result =
        run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", out, "--size", "8192",
                  "--samples", "3", "--max-distance", "10%"},
                 options);
    EXPECT_EQ(result.exit_code, 130) << result.errors;
    // Half a second is what is promised, on a machine that is not busy with other tests.
    EXPECT_LT(result.seconds_after_signal, 1.0) << "after " << delay << " s";
    if (fs::exists(out)) {
      EXPECT_TRUE(names(out).empty()) << names(out)[0];
    }
  }
}

TEST(Command, KillLeavesNoPartialMap) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  const fs::path out = scene / "out";
  ProcessOptions options;
  options.signal = 9;
  // Somewhere while the file is written: try several moments.
  for (const double delay : {0.5, 0.9, 1.3}) {
    options.interrupt_after_seconds = delay;
    run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", out, "--size", "4096",
              "--max-distance", "10%"},
             options);
    if (!fs::exists(out)) continue;
    for (const std::string& name : names(out)) {
      if (name == "low_normal.png") {
        EXPECT_EQ(load_image(out / name).width, 4096U);
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

TEST(Command, SaysHowToGetADeviceWhereThereIsNone) {
  ProcessOptions options;
  options.environment = {{"OCL_ICD_VENDORS", test::scratch_folder()}};
  const fs::path scene = make_scene(500);
  const ProcessResult result =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "out"}, options);
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_NE(result.errors.find("pocl-opencl-icd"), std::string::npos) << result.errors;
  EXPECT_EQ(run_kiln({"devices"}, options).exit_code, 4);
}

}  // namespace
}  // namespace kiln
