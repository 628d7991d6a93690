// kiln measure: studies, and what it refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/call.h"
#include "cli/interrupted.h"
#include "cli/lab_scene.h"
#include "cli/measure_files.h"
#include "kiln/mesh.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/read_file.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::call_kiln;
using test::make_scene;
using test::ProcessOptions;
using test::ProcessResult;
using test::read_json;
using test::run_kiln;
using namespace test::measure_files;

TEST(MeasureCommand, StudiesViews) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(4000);
  const fs::path out = scene / "out";
  const std::vector<std::string> arguments = {"measure",
                                              scene / "high.obj",
                                              scene / "low.obj",
                                              "--study",
                                              "views",
                                              "--out",
                                              out,
                                              "--size",
                                              "128",
                                              "--view-size",
                                              "256",
                                              "--max-distance",
                                              "10%",
                                              "--pixels",
                                              "64",
                                              "--json",
                                              scene / "report.json"};
  const ProcessResult result = call_kiln(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  expect_files(out, "study_views", 2);

  const json report = read_json(scene / "report.json");
  for (const char* key :
       {"version", "device", "inputs", "options", "study", "measured_from", "settings",
        "levels_off_at", "findings", "seconds", "outputs", "warnings"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  EXPECT_EQ(report["options"]["size"], 128);
  EXPECT_EQ(report["measured_from"]["views"], 30);
  EXPECT_EQ(report["measured_from"]["size"], 64);
  EXPECT_GE(report["measured_from"]["least_angle_to_a_matching_view_degrees"].get<double>(), 2);
  ASSERT_EQ(report["settings"].size(), 24U);
  const double none = mean_of(select(report, "none").at(0));
  const double ray = mean_of(select(report, "ray").at(0));
  for (const char* curve : {"paper", "kiln"}) {
    const std::vector<json> settings = select(report, curve);
    ASSERT_EQ(settings.size(), 11U);
    EXPECT_EQ(settings[0]["views"], 1);
    EXPECT_EQ(settings[6]["views"], 12);
    EXPECT_EQ(settings[0]["view_refine"], std::string(curve) == "kiln");
    EXPECT_EQ(settings[0]["view_criterion"], std::string(curve) == "kiln" ? "angle" : "depth");
    EXPECT_EQ(settings[0]["view_size"], 256);
    // One view sees half of a sphere; twelve see it all.
    EXPECT_LT(settings[0]["matched_share"].get<double>(), 0.8);
    EXPECT_GT(settings[6]["matched_share"].get<double>(), 0.99);
    EXPECT_LT(mean_of(settings[0]), none);
    EXPECT_LT(mean_of(settings[6]), 0.5 * mean_of(settings[0])) << curve;
  }
  const json panel = read_json(out / "study_views_plot.json")["panels"][0];
  for (std::size_t c = 0; c < 2; ++c) {
    const std::vector<json> settings = select(report, c == 0 ? "paper" : "kiln");
    for (std::size_t i = 0; i < settings.size(); ++i) {
      EXPECT_EQ(panel["curves"][c]["x"][i], settings[i]["views"]);
      EXPECT_EQ(panel["curves"][c]["y"][i], mean_of(settings[i]));
    }
  }
  EXPECT_EQ(panel["levels"][0]["y"], ray);
  EXPECT_EQ(panel["levels"][1]["y"], none);
  EXPECT_NEAR(mean_of(select(report, "kiln")[6]), ray, 0.2 * ray);
  EXPECT_LT(mean_of(select(report, "kiln")[6]), mean_of(select(report, "paper")[6]));
}

TEST(MeasureCommand, StudiesFaces) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(1500);
  const fs::path out = scene / "out";
  const auto arguments = [&](const fs::path& folder) {
    return std::vector<std::string>{
        "measure", scene / "high.obj", "--study", "faces",       "--out", folder,     "--size",
        "128",     "--views",          "6",       "--view-size", "256",   "--pixels", "64"};
  };
  std::vector<std::string> first = arguments(out);
  first.insert(first.end(), {"--json", scene / "report.json", "--quiet"});
  const ProcessResult result = call_kiln(first);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.output, "");
  EXPECT_TRUE(test::only_warnings(result.errors)) << result.errors;
  expect_files(out, "study_faces", 3);
  const json report = read_json(scene / "report.json");
  const std::vector<json> settings = select(report, "kiln");
  ASSERT_EQ(settings.size(), 2U) << "500 and 1,000: the mesh has 1,568";
  EXPECT_EQ(settings[0]["target_faces"], 500);
  EXPECT_EQ(settings[1]["target_faces"], 1000);
  EXPECT_EQ(settings[1]["views"], 6);
  EXPECT_LT(mean_of(settings[1]), mean_of(settings[0]));
  for (const json& setting : settings) {
    const json& distance = setting["distance_error"];
    EXPECT_GT(distance["mean"].get<double>(), 0);
    EXPECT_LT(distance["mean"], distance["p95"]);
    EXPECT_LT(distance["p95"], distance["max"]);
    EXPECT_NEAR(distance["mean_percent_of_diagonal"].get<double>(),
                100 * distance["mean"].get<double>() / report["diagonal"].get<double>(), 1e-9);
  }
  EXPECT_LT(settings[1]["distance_error"]["mean"], settings[0]["distance_error"]["mean"]);

  const json plot = read_json(out / "study_faces_plot.json");
  // Depth differs less the more faces there are; it is the mesh's, whatever the map.
  const std::vector<json> plain = select(report, "none");
  EXPECT_GT(plain[1]["depth_difference"]["mean"].get<double>(), 0);
  EXPECT_LT(plain[1]["depth_difference"]["mean"], plain[0]["depth_difference"]["mean"]);
  EXPECT_FALSE(settings[0].contains("depth_difference"));
  EXPECT_EQ(plot["panels"][1]["curves"][0]["y"][0], plain[0]["depth_difference"]["mean"]);
  for (std::size_t i = 0; i < 2; ++i) {
    const json& distance = settings[i]["distance_error"];
    const json& curves = plot["panels"][0]["curves"];
    EXPECT_EQ(curves[0]["y"][i], distance["max_percent_of_diagonal"]);
    EXPECT_EQ(curves[1]["y"][i], distance["p95_percent_of_diagonal"]);
    EXPECT_EQ(curves[2]["y"][i], distance["mean_percent_of_diagonal"]);
    EXPECT_EQ(plot["x_ticks"][i], settings[i]["target_faces"]);
  }

  // Without Python, and on one thread: all the rest, the same bytes, and a word on how to get it.
  const fs::path other = scene / "other";
  ProcessOptions options;
  options.environment = {{"PATH", test::path_without("python3")},
                         {"KILN_THREADS", "1"},
                         {"POCL_MAX_PTHREAD_COUNT", "1"}};
  const ProcessResult without = run_kiln(arguments(other), options);
  EXPECT_EQ(without.exit_code, 0) << without.errors;
  EXPECT_NE(without.errors.find("python3-matplotlib"), std::string::npos) << without.errors;
  EXPECT_FALSE(fs::exists(other / "study_faces.png"));
  for (const char* name : {"study_faces.csv", "study_faces_plot.json"}) {
    EXPECT_TRUE(test::read_file(other / name) == test::read_file(out / name)) << name;
  }
}

TEST(MeasureCommand, StudiesSize) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(1500);
  const fs::path out = scene / "out";
  const ProcessResult result =
      call_kiln({"measure", scene / "high.obj", "--study", "size", "--out", out, "--views", "4",
                 "--view-size", "256", "--pixels", "64", "--json", "-"},
                test::without_python().environment);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  expect_files(out, "study_size", 1, false);
  // Standard output is the report's alone.
  const json report = json::parse(result.output);
  EXPECT_FALSE(fs::exists("-"));
  const std::vector<json> settings = select(report, "kiln");
  ASSERT_EQ(settings.size(), 10U);
  EXPECT_EQ(settings[0]["size"], 128);
  EXPECT_EQ(settings[4]["size"], 2048);
  EXPECT_GT(mean_of(settings[0]), mean_of(settings[4]));
  const json panel = read_json(out / "study_size_plot.json")["panels"][0];
  ASSERT_EQ(panel["curves"].size(), 2U);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    EXPECT_EQ(panel["curves"][i / 5]["x"][i % 5], settings[i]["size"]);
    EXPECT_EQ(panel["curves"][i / 5]["y"][i % 5], mean_of(settings[i]));
  }
  EXPECT_EQ(panel["rings"]["x"][0], report["levels_off_at"]["500"]);
  ASSERT_TRUE(report["levels_off_at"].contains("500"));
  EXPECT_LE(report["levels_off_at"]["500"].get<int>(), 1024) << "2,048 is wasted on 500 faces";
}

TEST(MeasureCommand, RefusesBadUsage) {
  const fs::path scene = make_scene(600);
  const fs::path out = scene / "out";
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  const auto expect = [&](std::vector<std::string> more, int code,
                          const std::vector<std::string>& words) {
    more.insert(more.begin(), "measure");
    const ProcessResult result = call_kiln(more);
    EXPECT_EQ(result.exit_code, code) << result.errors;
    for (const std::string& word : words) {
      EXPECT_NE(result.errors.find(word), std::string::npos) << word << " in " << result.errors;
    }
    EXPECT_TRUE(!fs::exists(out) || fs::is_empty(out));
  };
  expect({high, "--out", out}, 2, {"--study"});
  expect({high, low, "--out", out, "--faces", "100"}, 2, {"--faces"});
  expect({high, low, "--match", "ray", "--study", "views", "--size", "64", "--out", out}, 2,
         {"--match"});
  expect({high, "--study", "views"}, 2, {"--out"});
  expect({high, "--study", "weather", "--out", out}, 2, {"weather", "faces", "size", "views"});
  expect({high, low, "--study", "faces", "--out", out}, 2, {"faces", "low.obj"});
  expect({high, low, "--study", "size", "--out", out}, 2, {"size", "low.obj"});
  expect({high, low, "--study", "views", "--faces", "100", "--out", out}, 2, {"--faces"});
  expect({high, "--study", "views", "--views", "3", "--out", out}, 2, {"--views"});
  expect({high, "--study", "faces", "--faces", "300", "--out", out}, 2, {"--faces"});
  expect({high, "--study", "size", "--size", "300", "--out", out}, 2, {"--size"});
  expect({high, "--study", "faces", "--views", "0", "--out", out}, 2, {"--views"});
  expect({high, "--study", "faces", "--size", "1", "--out", out}, 2, {"--size"});
  expect({high, "--study", "faces", "--pixels", "4", "--out", out}, 2, {"--pixels"});
  expect({high, "--study", "views", "--max-distance", "0", "--out", out}, 2, {"--max-distance"});
  expect({high, "--study", "faces", "--zoom", "2", "--out", out}, 2, {"--zoom", "--study"});
  expect({high, low, "--picture-size", "90"}, 2, {"--picture-size", "--out"});
  expect({high, "--study", "views", "--out", high + "/such"}, 5, {"high.obj/such"});
}

TEST(MeasureCommand, NamesTheRemedyForBadInput) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(200);
  const fs::path out = scene / "out";
  const std::string high = scene / "high.obj";
  ProcessResult result =
      call_kiln({"measure", high, "--study", "faces", "--size", "64", "--out", out});
  EXPECT_EQ(result.exit_code, 3) << result.errors;
  EXPECT_NE(result.errors.find("500"), std::string::npos) << result.errors;
  result = call_kiln({"measure", high, high, "--study", "views", "--size", "64", "--out", out});
  EXPECT_EQ(result.exit_code, 3) << result.errors;
  EXPECT_NE(result.errors.find("--unwrap"), std::string::npos) << result.errors;
  Mesh away = test::BumpySphere::light(24, 12);
  for (Vec3& position : away.positions) position.x += 100;
  save_obj(away, scene / "away.obj");
  result = call_kiln(
      {"measure", high, scene / "away.obj", "--study", "views", "--size", "64", "--out", out});
  EXPECT_EQ(result.exit_code, 3) << result.errors;
  EXPECT_NE(result.errors.find("units"), std::string::npos) << result.errors;
  EXPECT_EQ(
      call_kiln({"measure", scene / "none.ply", "--study", "views", "--size", "64", "--out", out})
          .exit_code,
      3);
  EXPECT_FALSE(fs::exists(out));  // made for nothing, so gone
}

TEST(MeasureCommand, InterruptLeavesNothing) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(20000);
  for (const double after : {0.1, 0.7}) {
    test::expect_interrupt_leaves_nothing({"measure", scene / "high.obj", "--study", "size"}, after,
                                          0.6);
  }
}

}  // namespace
}  // namespace kiln
