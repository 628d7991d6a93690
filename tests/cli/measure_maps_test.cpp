// Errors of maps in kiln measure (--maps).
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/call.h"
#include "cli/lab_scene.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/process.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::make_scene;
using test::ProcessResult;
using test::read_json;

TEST(MeasureMaps, TellsErrorsOfMapsAsTheBakeDoes) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  save_obj(test::plane(1, 1, 8, 8), scene / "ground.obj");
  using Words = std::vector<std::string>;
  const auto run = [&](Words words, const Words& more) {
    words.insert(words.begin() + 1,
                 {scene / "high.obj", scene / "low.obj", "--max-distance", "10%", "--size", "16"});
    words.insert(words.end(), more.begin(), more.end());
    return call_kiln(words);
  };
  const Words rated = {"measure", "--match",  "ray", "--match", "closest",       "--directions",
                       "12",      "--pixels", "32",  "--json",  scene / "r.json"};
  const Words maps = {"--maps",
                      "ao,id,curvature",
                      "--ao-rays",
                      "4",
                      "--curvature-radius",
                      "3%",
                      "--ao-occluders",
                      "high," + (scene / "ground.obj").string()};
  const ProcessResult result = run(rated, maps);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(scene / "r.json");
  EXPECT_EQ(report["options"]["maps"], json::array({"ao", "id", "curvature"}));
  for (const json& row : report["methods"]) {
    const std::string name = row["name"];
    Words bake = {"bake",   "--match",        name,    "--report-error",
                  "--json", scene / "b.json", "--out", scene / name};
    const ProcessResult baked = run(bake, maps);
    ASSERT_EQ(baked.exit_code, 0) << baked.errors;
    EXPECT_EQ(row["errors"], read_json(scene / "b.json")["errors"]) << name;
    ASSERT_EQ(row["errors"].size(), 3U);  // ao in two ways
    for (const json& error : row["errors"]) EXPECT_GT(error["rms"], 0) << name;
    EXPECT_EQ(row["without_error"], json::array({"id"}));
    EXPECT_NE(result.output.find("states no error"), std::string::npos) << result.output;
  }
  EXPECT_NE(report["methods"][0]["errors"], report["methods"][1]["errors"]);
  // A picture over HIGH's UVs, and the normals where they are asked for.
  save_image({2, 1, 3, {1, 0, 0, 0, 1, 0}}, scene / "paint.png", {ImageFormat::png8});
  const Words painted = {"--maps", "normal", "--transfer", scene / "paint.png"};
  const auto plane = [&](Words words) {
    words.insert(words.begin() + 1, {scene / "ground.obj", scene / "ground.obj"});
    words.insert(words.end(), {"--match", "ray", "--max-distance", "10%", "--size", "16"});
    words.insert(words.end(), painted.begin(), painted.end());
    return call_kiln(words);
  };
  ASSERT_EQ(plane({"measure", "--json", scene / "p.json", "--directions", "12", "--pixels", "32"})
                .exit_code,
            0);
  ASSERT_EQ(
      plane({"bake", "--report-error", "--json", scene / "b.json", "--out", scene / "p"}).exit_code,
      0);
  const json flat = read_json(scene / "p.json");
  EXPECT_EQ(flat["options"]["maps"], json::array({"normal", "paint"}));
  EXPECT_EQ(flat["methods"][0]["errors"], read_json(scene / "b.json")["errors"]);
  ASSERT_EQ(flat["methods"][0]["errors"].size(), 2U);
  EXPECT_EQ(flat["methods"][0]["errors"][1]["map"], "paint");
  EXPECT_EQ(flat["methods"][0]["without_error"], json::array());
  // Ratings are those of the match, whatever is baked beside.
  ASSERT_EQ(run(rated, {}).exit_code, 0);
  const json plain = read_json(scene / "r.json");
  EXPECT_FALSE(plain["options"].contains("maps"));
  for (std::size_t i = 0; i < 2; ++i) {
    const json &with = report["methods"][i], &without = plain["methods"][i];
    EXPECT_EQ(with["rendered_normals"], without["rendered_normals"]);
    EXPECT_EQ(with["object_space"], without["object_space"]);
    EXPECT_FALSE(without.contains("errors"));
  }
  // A flag that serves no map asked for.
  EXPECT_EQ(run(rated, {"--maps", "normal", "--ao-rays", "4"}).exit_code, 2);
  EXPECT_EQ(run(rated, {"--curvature-radius", "1%"}).exit_code, 2);
  EXPECT_EQ(run(rated, {"--maps", "visibility"}).exit_code, 2);
  EXPECT_EQ(
      call_kiln({"measure", scene / "high.obj", "--study", "views", "--out", scene, "--maps", "ao"})
          .exit_code,
      2);
}

}  // namespace
}  // namespace kiln
