// kiln simplify: layouts and hulls.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/command_scene.h"
#include "kiln/kiln.h"
#include "support/json_file.h"
#include "support/process.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::make_scene;
using test::ProcessResult;
using test::read_json;
using test::run_kiln;

/// The report.
json simplify_to(const fs::path& scene, const std::vector<std::string>& flags) {
  std::vector<std::string> words = {"simplify", scene / "high.obj", "--faces", "300",
                                    "--out",    scene / "made.obj", "--json",  scene / "made.json"};
  words.insert(words.end(), flags.begin(), flags.end());
  const ProcessResult result = run_kiln(words);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  return read_json(scene / "made.json");
}

TEST(SimplifyCommand, PairsAreManyChartsAndChartsFew) {
  const fs::path scene = make_scene(4000);
  EXPECT_LT(simplify_to(scene, {})["charts"], 60);
  const json pairs = simplify_to(scene, {"--unwrap", "pairs"});
  EXPECT_EQ(pairs["unwrap"], "pairs");
  // Two triangles each, and some left over.
  EXPECT_GE(pairs["charts"], 150);
  EXPECT_EQ(pairs["border_texels"], 2);
}

TEST(SimplifyCommand, TexelsGoByAreaOrDetail) {
  const fs::path scene = make_scene(4000);
  const json area = simplify_to(scene, {"--size", "128"});
  EXPECT_EQ(area["density"], "area");
  const Mesh as_before = load_mesh(scene / "made.obj");
  EXPECT_EQ(simplify_to(scene, {"--size", "128", "--density", "area"})["charts"], area["charts"]);
  EXPECT_EQ(load_mesh(scene / "made.obj").uvs, as_before.uvs);
  EXPECT_EQ(simplify_to(scene, {"--size", "128", "--density", "detail"})["density"], "detail");
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--unwrap", "pairs", "--density", "area"},
        {"--keep-uvs", "--density", "detail"},
        {"--density", "most"}}) {
    std::vector<std::string> words = {"simplify", scene / "high.obj", "--faces", "99",
                                      "--out",    scene / "bad.obj"};
    words.insert(words.end(), flags.begin(), flags.end());
    const ProcessResult bad = run_kiln(words);
    EXPECT_EQ(bad.exit_code, 2);
    EXPECT_NE(bad.errors.find("--density"), std::string::npos) << bad.errors;
    EXPECT_FALSE(fs::exists(scene / "bad.obj"));
  }
}

TEST(SimplifyCommand, AHullEnclosesMore) {
  const fs::path scene = make_scene(4000);
  const auto volume = [&](const fs::path& path) {
    const Mesh mesh = load_mesh(path);
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
      const Vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
      sum += double{a.x} * (double{b.y} * c.z - double{b.z} * c.y) +
             double{a.y} * (double{b.z} * c.x - double{b.x} * c.z) +
             double{a.z} * (double{b.x} * c.y - double{b.y} * c.x);
    }
    return sum / 6;
  };
  EXPECT_FALSE(simplify_to(scene, {})["hull"].get<bool>());
  const double plain = volume(scene / "made.obj"), high = volume(scene / "high.obj");
  EXPECT_TRUE(simplify_to(scene, {"--hull"})["hull"].get<bool>());
  EXPECT_LT(plain, high);
  EXPECT_GT(volume(scene / "made.obj"), high);
  const ProcessResult both = run_kiln({"simplify", scene / "high.obj", "--hull", "--keep-uvs",
                                       "--faces", "99", "--out", scene / "both.obj"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_NE(both.errors.find("--keep-uvs"), std::string::npos) << both.errors;
}

}  // namespace
}  // namespace kiln
