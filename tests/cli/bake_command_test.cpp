// kiln bake as its users meet it: files, the report, and its figures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/pictures.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_failure;
using test::make_scene;
using test::names;
using test::ProcessResult;
using test::read_json;
using test::run_kiln;

TEST(Command, BakesTheContractsFilesAndReport) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const fs::path out = scene / "out";
  const ProcessResult result =
      call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", out, "--size", "256x128",
                 "--max-distance", "10%", "--json", scene / "report.json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(names(out), std::vector<std::string>{"low_normal.png"});
  const Image map = test::read_picture(out / "low_normal.png");
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
        const Image image = test::read_picture(levels[level]["file"].get<std::string>());
        EXPECT_EQ(levels[level]["width"], std::max(70 >> level, 1));
        EXPECT_EQ(levels[level]["height"], std::max(33 >> level, 1));
        EXPECT_EQ(image.width, png ? std::max(70U >> level, 1U) : 70U);
      }
      for (const std::string& name : expected) {
        const std::string now = test::read_file(out / name);
        const auto [known, first] = bytes.emplace(name, now);
        EXPECT_TRUE(first || known->second == now) << name;
      }
    }
  }
  // A map of one texel has no levels below.
  const ProcessResult one =
      call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "one", "--size",
                 "1", "--mips", "--max-distance", "10%"});
  ASSERT_EQ(one.exit_code, 0) << one.errors;
  EXPECT_EQ(names(scene / "one"), std::vector<std::string>{"low_normal.png"});
}

TEST(Command, MakesTheLightMeshWhereNoneIsGiven) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const fs::path out = scene / "out";
  const ProcessResult result =
      call_kiln({"bake", scene / "high.obj", "--out", out, "--size", "512", "--faces", "500"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(names(out), (std::vector<std::string>{"high_low.obj", "high_low_normal.png"}));
  const Mesh low = load_mesh(out / "high_low.obj");
  EXPECT_NEAR(static_cast<double>(low.triangles.size()), 500, 10);
  EXPECT_EQ(low.uv_triangles.size(), low.triangles.size());
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
  EXPECT_EQ(call_kiln(by_rays).exit_code, 2);
  std::vector<std::string> good = base;
  good.insert(good.end(), {"--match", "visibility", "--visibility-deviation", "0.5"});
  const ProcessResult result = call_kiln(good);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(names(scene / "clusters"),
            (std::vector<std::string>{"low_clusters.exr", "low_normal.png", "low_normal_1.png"}));
  // The first layer that has X Y Z.
  const Image directions = test::read_picture(scene / "clusters/low_clusters.exr");
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
  EXPECT_EQ(call_kiln(command).exit_code, 2);
  command.insert(command.end(), {"--fallback", "closest"});
  const ProcessResult result = call_kiln(command);
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
  ASSERT_EQ(call_kiln(first).exit_code, 0);
  std::vector<std::string> second = base;
  second.insert(second.end(), {"--out", scene / "b", "--load-match", scene / "match.exr"});
  ASSERT_EQ(call_kiln(second).exit_code, 0);
  EXPECT_EQ(call_kiln({"diff", scene / "a/low_normal.png", scene / "b/low_normal.png"}).exit_code,
            0);

  std::vector<std::string> wrong = {
      "bake",  scene / "high.obj", scene / "low.obj", "--size",           "100",
      "--out", scene / "c",        "--load-match",    scene / "match.exr"};
  expect_failure(wrong, 3, {"match", "200"}, scene / "c");
}

TEST(Command, CageTakesRaysTwiceAsLongWhereNoneAreGiven) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const auto missed = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"bake",  scene / "high.obj", scene / "low.obj",
                                          "--out", scene / "out",      "--size",
                                          "128",   "--json",           scene / "r.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = call_kiln(arguments);
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

}  // namespace
}  // namespace kiln
