// kiln chart of volumes, equal layouts and height fields.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "cli/call.h"
#include "cli/chart_files.h"
#include "cli/lab_scene.h"
#include "kiln/height_field.h"
#include "kiln/image.h"
#include "kiln/volume.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/shapes.h"
#include "support/volumes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::make_scene;
using test::ProcessResult;
using test::read_json;
using namespace test::chart_files;

Volume bumpy_ball() {
  return test::make_volume<std::uint8_t>(
      {48, 48, 48}, VoxelType::u8, [](double x, double y, double z) {
        const double r = std::hypot(x - 23.5, y - 23.5, z - 23.5);
        const double bump = 1.2 * std::sin(0.5 * x) * std::sin(0.5 * y) * std::sin(0.5 * z);
        return std::clamp(128 + 16 * (18 + bump - r), 0.0, 255.0);
      });
}

TEST(ChartCommand, ComparesWaysToMapAVolume) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  save_nrrd(bumpy_ball(), scene / "ball.nrrd");
  Volume other = bumpy_ball();
  other.axes = {{{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}}};
  save_nrrd(other, scene / "small.nrrd");
  const fs::path out = scene / "out";
  const ProcessResult result =
      call_kiln({"chart", scene / "ball.nrrd", scene / "small.nrrd", "--iso", "127.5", "--faces",
                 "300", "--size", "128", "--repeat", "1", "--pixels", "64", "--out", out});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(out / "chart.json");
  EXPECT_EQ(report["options"]["iso"], 127.5);
  EXPECT_EQ(report["options"]["faces"], 300);
  ASSERT_EQ(report["volumes"].size(), 2U);
  const std::vector<std::string> names = {
      "none",    "direct_64",   "direct_128",   "direct_256", "ray_64",      "ray_128",
      "ray_256", "ray_2x2_128", "views_12_128", "closest_64", "closest_128", "closest_256"};
  for (const json& volume : report["volumes"]) {
    EXPECT_LE(volume["light"]["faces"], 300);
    ASSERT_EQ(volume["settings"].size(), names.size());
    ASSERT_EQ(volume["sizes"].size(), 3U);
    for (const json& size : volume["sizes"]) {
      EXPECT_GT(size["covered_texels"], size["size"].get<int>() * size["size"].get<int>() / 8);
      EXPECT_EQ(size["border_texels"], 0);
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      const json& setting = volume["settings"][i];
      EXPECT_EQ(setting["name"], names[i]);
      expect_finite(setting["gradient_error"], names[i]);
      const json& s = setting["seconds"];
      EXPECT_GT(s["total"], 0);
      EXPECT_NEAR(s["total"].get<double>(),
                  s["contour"].get<double>() + s["light"].get<double>() + s["build"].get<double>() +
                      s["map"].get<double>(),
                  0.2 * s["total"].get<double>() + 0.02);
      ASSERT_EQ(setting["runs"].size(), 1U);
      EXPECT_EQ(s["build"] > 0, setting.contains("texels"));
    }
    // Every map is far nearer than none, by either measure; a map of 128 texels a side is large enough
    // for the ways to agree.
    const double none = find(volume, "none")["gradient_error"]["mean_angle_degrees"];
    EXPECT_GT(none, 3);
    for (const char* name : {"direct_128", "ray_128", "ray_2x2_128", "closest_128"}) {
      const json setting = find(volume, name);
      EXPECT_LT(setting["gradient_error"]["mean_angle_degrees"], 0.5 * none) << name;
      EXPECT_LT(setting["gradient_error_along_face"]["mean_angle_degrees"], 0.5 * none) << name;
      EXPECT_LT(error_of(setting, "normal_error"),
                0.6 * error_of(find(volume, "none"), "normal_error"))
          << name;
    }
  }
  // The same volume in other units: the same errors.
  for (const char* name : {"none", "direct_128", "ray_128"}) {
    EXPECT_NEAR(
        find(report["volumes"][0], name)["gradient_error"]["mean_angle_degrees"].get<double>(),
        find(report["volumes"][1], name)["gradient_error"]["mean_angle_degrees"].get<double>(),
        0.02);
  }
  EXPECT_EQ(read_lines(out / "chart.csv").size(), 1 + 2 * names.size());
  for (const std::string& name : names) {
    EXPECT_NE(result.output.find(name + " "), std::string::npos) << name;
  }
  EXPECT_TRUE(fs::exists(out / "chart.md"));
  const json plot = read_json(out / "chart_plot.json");
  ASSERT_EQ(plot["groups"].size(), 2U);
  for (std::size_t v = 0; v < 2; ++v) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const json& setting = report["volumes"][v]["settings"][i];
      const json& panels = plot["groups"][v]["panels"];
      EXPECT_EQ(panels[0]["marks"][i]["error"], setting["gradient_error"]["mean_angle_degrees"]);
      EXPECT_EQ(panels[1]["marks"][i]["error"], setting["normal_error"]["mean_angle_degrees"]);
      EXPECT_EQ(panels[1]["marks"][i]["seconds"], setting["seconds"]["total"]);
    }
  }
  expect_picture(out, 2, 1);
}

TEST(ChartCommand, TakesVolumesWithoutHeaderAndSomeWays) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  const Volume volume = bumpy_ball();
  std::ofstream(scene / "ball.raw", std::ios::binary)
      .write(reinterpret_cast<const char*>(volume.voxels.data()),
             static_cast<std::streamsize>(volume.voxels.size()));
  const fs::path out = scene / "out";
  const ProcessResult result =
      call_kiln({"chart", scene / "ball.raw", "--raw-size", "48x48x48", "--iso", "127.5", "--error",
                 "0.5", "--size", "128", "--repeat", "2", "--pixels", "64", "--settings",
                 "ray_2x2,direct", "--quiet", "--out", out},
                test::without_python().environment);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.output, "");
  EXPECT_TRUE(test::only_warnings(result.errors)) << result.errors;
  const json report = read_json(out / "chart.json");
  std::vector<std::string> names;
  for (const json& setting : report["volumes"][0]["settings"]) {
    names.push_back(setting["name"]);
    const json& runs = setting["runs"];  // of two, the faster one counts
    ASSERT_EQ(runs.size(), 2U);
    EXPECT_EQ(setting["seconds"]["total"], std::min(runs[0]["total"], runs[1]["total"]));
  }
  // At half the size the charts may have no room: then it is left out, with a warning.
  const bool skipped = report["volumes"][0]["sizes"].size() == 2;
  if (!skipped) {
    EXPECT_EQ(names,
              (std::vector<std::string>{"direct_64", "direct_128", "direct_256", "ray_2x2_128"}));
  }
  EXPECT_EQ(skipped, std::any_of(report["warnings"].begin(), report["warnings"].end(),
                                 [](const json& w) { return w["code"] == "size-skipped"; }));

  const auto refuse = [&](std::vector<std::string> more, int code, const std::string& word) {
    more.insert(more.begin(), "chart");
    more.insert(more.end(), {"--out", scene / "none"});
    const ProcessResult refused = call_kiln(more);
    EXPECT_EQ(refused.exit_code, code) << refused.errors;
    EXPECT_NE(refused.errors.find(word), std::string::npos) << refused.errors;
    EXPECT_FALSE(fs::exists(scene / "none"));
  };
  save_nrrd(volume, scene / "ball.nrrd");
  const std::string ball = scene / "ball.nrrd";
  refuse({ball}, 2, "--iso");
  refuse({ball, "low.obj", "--iso", "3"}, 2, "low.obj");
  refuse({"high.ply", ball}, 2, "ball.nrrd");
  refuse({"high.ply", "low.obj", "--iso", "3"}, 2, "--iso");
  refuse({"high.ply", "low.obj", "--settings", "direct"}, 2, "direct");
  refuse({ball, "--iso", "3", "--settings", "hybrid"}, 2, "hybrid");
  refuse({ball, "--iso", "3", "--topology", "free"}, 2, "--faces");
  refuse({ball, "--iso", "3", "--raw-type", "u8"}, 2, "--raw-size");
  refuse({ball, "--iso", "3", "--ao"}, 2, "--ao");
  refuse({ball, "--iso", "3", "--directions", "64"}, 2, "--directions");
  refuse({ball, "--iso", "3", "--settings", "ray", "closest"}, 2, "separate settings by commas");
  refuse({scene / "no.nrrd", "--iso", "3"}, 3, "no.nrrd");
  refuse({ball, "--iso", "999"}, 3, "range");
}

TEST(ChartCommand, MatchesByUvsWhereLayoutsAgree) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Mesh high = test::plane(40, 40);
  for (Vec3& p : high.positions) p.z = 0.01F * std::sin(20 * p.x) * std::cos(17 * p.y);
  high.normals.clear();
  high.normal_triangles.clear();
  save_obj(high, scene / "high.obj");
  save_obj(test::plane(2, 2), scene / "low.obj");
  Mesh turned = test::plane(2, 2);
  for (Vec2& uv : turned.uvs) uv = {uv.y, 1 - uv.x};
  save_obj(turned, scene / "turned.obj");
  const auto chart = [&](const fs::path& low, const fs::path& out, const std::string& settings) {
    return call_kiln({"chart", scene / "high.obj", low, "--out", out, "--size", "64", "--repeat",
                      "1", "--max-distance", "10%", "--directions", "12", "--pixels", "64",
                      "--quiet", "--settings", settings},
                     test::without_python().environment);
  };
  const ProcessResult result = chart(scene / "low.obj", scene / "out", "ray,uv");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json pair = read_json(scene / "out" / "chart.json")["pairs"][0];
  expect_pair(pair, {"ray", "ray_4x4", "uv"}, 1);
  EXPECT_EQ(find(pair, "uv")["family"], "uv");
  // Over a plane, the normals' lines and the UVs say the same.
  EXPECT_NEAR(error_of(find(pair, "uv"), "map_error"), error_of(find(pair, "ray"), "map_error"),
              0.01);

  const ProcessResult refused = chart(scene / "turned.obj", scene / "none", "uv");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.errors.find("UV layouts do not correspond"), std::string::npos)
      << refused.errors;
  EXPECT_FALSE(fs::exists(scene / "none"));
}

TEST(ChartCommand, TakesHeightFields) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Image image{33, 33, 1, std::vector<float>(std::size_t{33} * 33)};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = 0.5F + 0.4F * std::sin(0.2F * static_cast<float>(i % 33));
  }
  save_image(image, scene / "field.png", {ImageFormat::png16});
  save_image(image, scene / "same.exr", {ImageFormat::exr_float});
  const Mesh low = height_field_plane(image, {.width = 2, .height = 0.3});
  save_obj(low, scene / "low.obj");
  Mesh mesh = height_field_mesh(image, {.width = 2, .height = 0.3});
  save_obj(mesh, scene / "mesh.obj");
  const std::vector<std::string> arguments = {"chart",
                                              scene / "field.png",
                                              scene / "low.obj",
                                              scene / "same.exr",
                                              scene / "low.obj",
                                              "--height",
                                              "0.3",
                                              "--extent",
                                              "2",
                                              "--out",
                                              scene / "out",
                                              "--size",
                                              "64",
                                              "--repeat",
                                              "1",
                                              "--max-distance",
                                              "40%",
                                              "--directions",
                                              "12",
                                              "--pixels",
                                              "64",
                                              "--settings",
                                              "ray,uv"};
  // One Python without matplotlib, and then one that fails: its own words are what to go by.
  const std::string bare = "exec '" + test::found_program("python3") + "' -S \"$@\"";
  const std::string path = test::folder_with("python3", bare) + ":" +
                           test::folder_with("python3", "echo broken >&2; exit 5") + ":" +
                           test::path_without("python3");
  const ProcessResult result = call_kiln(arguments, {{"PATH", path}});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(result.errors.find("broken"), std::string::npos) << result.errors;
  const json report = read_json(scene / "out" / "chart.json");
  EXPECT_EQ(count_warnings(report, "no-plot", "exit code 5: broken"), 1U);
  EXPECT_EQ(report["options"]["height"], 0.3);
  EXPECT_EQ(report["options"]["extent"], "2");
  ASSERT_EQ(report["pairs"].size(), 2U);
  for (const json& pair : report["pairs"]) {
    expect_pair(pair, {"ray", "ray_4x4", "uv"}, 1);
    EXPECT_EQ(pair["high"]["triangles"], 2 * 32 * 32);
    EXPECT_NEAR(pair["diagonal"].get<double>(), std::sqrt(4 + 4 + 0.24 * 0.24), 0.01);
    EXPECT_NEAR(error_of(find(pair, "uv"), "map_error"), error_of(find(pair, "ray"), "map_error"),
                0.05);
  }
  // The same surface as a mesh is held to what meshes are.
  const auto mesh_chart = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"chart", scene / "mesh.obj", scene / "low.obj", "--out",
                               scene / "none", "--settings", "uv"});
    return call_kiln(more);
  };
  EXPECT_EQ(mesh_chart({"--max-distance", "40%"}).exit_code, 3);
  EXPECT_EQ(mesh_chart({"--height", "0.3"}).exit_code, 2);
  EXPECT_EQ(call_kiln({"chart", scene / "field.png", scene / "low.obj", "--extent", "x", "--out",
                       scene / "none"})
                .exit_code,
            2);
}

}  // namespace
}  // namespace kiln
