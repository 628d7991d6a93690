// kiln bake --sets: files, sizes, reports and refusals.
#include <gtest/gtest.h>

#include "cli/command_scene.h"
#include "support/json_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::expect_exit;
using test::expect_failure;
using test::low_of_halves;
using test::make_scene;
using test::names;
using test::ProcessResult;
using test::read_json;
using test::run_kiln;

fs::path make_scene_of_sets(float tile) {
  const fs::path folder = make_scene();
  save_obj(low_of_halves(tile, "Glass pane/1"), folder / "low.obj");
  return folder;
}

std::vector<std::string> command(const fs::path& scene) {
  return {"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "o", "--size", "64"};
}

std::vector<std::string> with(std::vector<std::string> words,
                              const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

TEST(SetsCommand, MaterialsThatOverlapGetMapsOfTheirOwn) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(0);
  const ProcessResult result =
      run_kiln(with(command(scene), {"--size", "body=32x16", "--json", scene / "r.json"}));
  expect_exit(result, 0, {});
  EXPECT_EQ(names(scene / "o"),
            (std::vector<std::string>{"low_Glass_pane_1_normal.png", "low_body_normal.png"}));
  EXPECT_EQ(load_image(scene / "o/low_body_normal.png").width, 32U);
  EXPECT_EQ(load_image(scene / "o/low_Glass_pane_1_normal.png").width, 64U);
  const auto report = read_json(scene / "r.json");
  EXPECT_EQ(report["options"]["sets"], "material");
  ASSERT_EQ(report["sets"].size(), 2U);
  EXPECT_EQ(report["sets"][0]["name"], "Glass pane/1");
  EXPECT_EQ(report["sets"][1]["height"], 16);
  EXPECT_EQ(report["texels"]["samples"], report["sets"][0]["texels"]["samples"].get<int>() +
                                             report["sets"][1]["texels"]["samples"].get<int>());
}

TEST(SetsCommand, TilesAreNumbered) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(1);
  expect_exit(run_kiln(with(command(scene), {"--mips"})), 0, {});
  const std::vector<std::string> files = names(scene / "o");
  for (const char* name :
       {"low_normal.1001.png", "low_normal.1002.png", "low_normal.1002.mip01.png"}) {
    EXPECT_TRUE(std::find(files.begin(), files.end(), name) != files.end()) << name;
  }
}

TEST(SetsCommand, RefusesWhatHasNoSets) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene_of_sets(0);
  const fs::path out = scene / "o";
  expect_failure(with(command(scene), {"--size", "wood=64"}), 2, {"wood", "'body'"}, out);
  expect_failure(with(command(scene), {"--size", "64"}), 2, {"--size", "twice"}, out);
  expect_failure(with(command(scene), {"--sets", "none", "--size", "body=64"}), 2, {"--sets none"},
                 out);
  expect_failure(with(command(scene), {"--sets", "material", "--save-match", scene / "m.exr"}), 2,
                 {"--save-match"}, out);
  expect_failure({"bake", scene / "high.obj", "--faces", "500", "--sets", "udim", "--out", out}, 2,
                 {"--sets udim", "atlas"}, out);
}

}  // namespace
}  // namespace kiln
