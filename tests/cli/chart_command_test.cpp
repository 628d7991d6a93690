// kiln chart of meshes: figures, front, files, exit codes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/call.h"
#include "cli/chart_files.h"
#include "cli/interrupted.h"
#include "cli/lab_scene.h"
#include "kiln/mesh.h"
#include "lab/chart.h"
#include "support/environment.h"
#include "support/pictures.h"
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

/// One of each family, in the chart's order; ChartSettings looks at what each of all is.
const std::vector<std::string> kSettings = {"ray",        "ray_2x2",  "ray_4x4",      "views_12",
                                            "views_auto", "paper_12", "views_12_ray", "closest"};

TEST(ChartCommand, MeasuresSettings) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  std::string settings;
  for (const std::string& name : kSettings) settings += (settings.empty() ? "" : ",") + name;
  const fs::path out = scene / "out";
  const std::vector<std::string> arguments = {"chart",
                                              scene / "high.obj",
                                              scene / "low.obj",
                                              "--out",
                                              out,
                                              "--size",
                                              "64",
                                              "--repeat",
                                              "1",
                                              "--directions",
                                              "12",
                                              "--pixels",
                                              "32",
                                              "--max-distance",
                                              "10%",
                                              "--settings",
                                              settings};
  const ProcessResult result = call_kiln(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(out / "chart.json");
  for (const char* key : {"version", "device", "options", "pairs", "seconds", "memory", "outputs",
                          "warnings", "compile_seconds"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  EXPECT_EQ(report["options"]["size"], 64);
  EXPECT_EQ(report["options"]["repeat"], 1);
  EXPECT_EQ(report["options"]["directions"], 12);
  EXPECT_EQ(report["options"]["settings"].get<std::vector<std::string>>(), kSettings);
  ASSERT_EQ(report["pairs"].size(), 1U);
  const json& pair = report["pairs"][0];
  expect_pair(pair, kSettings, 1);
  EXPECT_TRUE(pair["left_out"].empty());
  EXPECT_EQ(pair["measured_from"]["views"], 30);
  EXPECT_EQ(pair["measured_from"]["size"], 32);
  EXPECT_GE(pair["measured_from"]["least_angle_to_a_matching_view_degrees"].get<double>(), 2);

  // Rays with the reference's own settings are the reference; fewer samples are farther from it.
  const json reference = find(pair, "ray_4x4");
  EXPECT_EQ(reference["map_error"]["max_angle_degrees"], 0);
  for (const std::string& name : kSettings) {
    if (name == "ray_4x4") continue;
    EXPECT_GT(error_of(find(pair, name), "map_error"), 0) << name;
  }
  EXPECT_LT(error_of(find(pair, "ray_2x2"), "map_error"), error_of(find(pair, "ray"), "map_error"));
  // The settings are what their names say.
  EXPECT_EQ(find(pair, "ray_2x2")["samples"], 2);
  EXPECT_EQ(find(pair, "paper_12")["view_criterion"], "depth");
  EXPECT_EQ(find(pair, "paper_12")["view_refine"], false);
  EXPECT_EQ(find(pair, "views_12")["view_refine"], true);
  EXPECT_EQ(find(pair, "views_12_ray")["fallback"], "ray");
  EXPECT_EQ(find(pair, "views_12")["fallback"], "low");
  EXPECT_EQ(find(pair, "closest")["match"], "closest");
  EXPECT_EQ(find(pair, "closest")["texels"]["outward"], 0);
  EXPECT_TRUE(find(pair, "views_auto")["views_chosen"].get<bool>());
  EXPECT_FALSE(find(pair, "views_auto")["views"]["coverage_after_each"].empty());
  // Points left on the view's lines stand for others than the normals' lines do.
  EXPECT_GT(error_of(find(pair, "paper_12"), "map_error"),
            error_of(find(pair, "views_12"), "map_error"));

  // Every setting is in the table and in the data, with the figures of the report.
  const std::vector<std::string> lines = read_lines(out / "chart.csv");
  ASSERT_EQ(lines.size(), 1 + kSettings.size());
  const auto cells = [](const std::string& line) {
    std::vector<std::string> result(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == ',' && !quoted) {
        result.emplace_back();
      } else {
        result.back() += c;
      }
    }
    return result;
  };
  const std::vector<std::string> columns = cells(lines[0]);
  for (std::size_t i = 0; i < kSettings.size(); ++i) {
    const std::vector<std::string> values = cells(lines[i + 1]);
    ASSERT_EQ(values.size(), columns.size());
    const auto value = [&](const std::string& column) {
      const auto at = std::find(columns.begin(), columns.end(), column) - columns.begin();
      return values.at(static_cast<std::size_t>(at));
    };
    EXPECT_EQ(value("pair"), "1");
    EXPECT_EQ(value("name"), kSettings[i]);
    const json setting = find(pair, kSettings[i]);
    EXPECT_NEAR(std::stod(value("seconds.correspondence")), seconds_of(setting), 1e-6);
    for (const char* path :
         {"map_error.mean_angle_degrees", "object_space_percent", "normalised_image_space",
          "uniformity_percent", "normal_error.mean_angle_degrees"}) {
      std::string pointer = "/" + std::string(path);
      std::replace(pointer.begin(), pointer.end(), '.', '/');
      EXPECT_NEAR(std::stod(value(path)), setting[json::json_pointer(pointer)].get<double>(), 1e-6);
    }
  }
  const std::vector<std::string> table = read_lines(out / "chart.md");
  EXPECT_EQ(std::count_if(table.begin(), table.end(),
                          [](const std::string& line) { return line.starts_with("|"); }),
            static_cast<long>(kSettings.size() + 2));

  // The picture shows what the report says.
  const json plot = read_json(out / "chart_plot.json");
  EXPECT_EQ(plot["kind"], "chart");
  ASSERT_EQ(plot["groups"].size(), 1U);
  const json& panels = plot["groups"][0]["panels"];
  ASSERT_EQ(panels.size(), 4U);
  const std::vector<std::string> measures = {"object_space", "normalised_image_space", "uniformity",
                                             "normal_error"};
  for (std::size_t p = 0; p < 4; ++p) {
    const std::string measure = panels[p]["name"];
    EXPECT_EQ(measure, measures[p]);
    ASSERT_EQ(panels[p]["marks"].size(), kSettings.size());
    for (std::size_t i = 0; i < kSettings.size(); ++i) {
      const json& mark = panels[p]["marks"][i];
      const json& setting = pair["settings"][i];
      EXPECT_EQ(mark["seconds"], setting["seconds"]["correspondence"]);
      EXPECT_EQ(mark["runs"].size(), 1U);
      EXPECT_EQ(mark["error"].get<double>(), error_of(setting, measure));
      EXPECT_EQ(mark["front"], setting["on_front"][measure]);
      EXPECT_EQ(mark["family"], setting["family"]);
      EXPECT_EQ(std::count_if(plot["styles"].begin(), plot["styles"].end(),
                              [&](const json& s) { return s["family"] == mark["family"]; }),
                1);
    }
  }
  EXPECT_EQ(panels[0]["marks"][2]["label"], "rays, 4×4 samples");
  expect_picture(out, 1, 2);
}

/// By default all are taken. Those that MeasuresSettings leaves are run by name, but for those whose views only have
/// more pixels than others.
TEST(ChartCommand, TakesAllSettingsThatServe) {
  KILN_REQUIRE_DEVICE();
  std::vector<std::string> all, wanted{"ray_4x4"};  // the reference
  std::string run;
  for (const cli::ChartSetting& setting : cli::chart_settings()) {
    all.push_back(setting.name);
    const bool known =
        std::find(kSettings.begin(), kSettings.end(), setting.name) != kSettings.end();
    if (known || setting.name == "uv" || setting.bake.match.views.size > 1024) continue;
    run += (run.empty() ? "" : ",") + setting.name;
    wanted.push_back(setting.name);
  }
  const cli::ChartArguments defaults;
  EXPECT_EQ(json::parse(cli::chart_of_matches(defaults)->options.dump())["settings"], json(all));
  const fs::path scene = make_scene(100);
  const std::vector<std::string> words = {"chart",
                                          scene / "high.obj",
                                          scene / "low.obj",
                                          "--size",
                                          "16",
                                          "--repeat",
                                          "1",
                                          "--directions",
                                          "12",
                                          "--pixels",
                                          "16",
                                          "--out",
                                          scene / "out",
                                          "--settings"};
  std::vector<std::string> serving = words, refused = words;
  serving.push_back(run);
  const ProcessResult result = call_kiln(serving, test::without_python().environment);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  std::vector<std::string> done;
  const json report = read_json(scene / "out" / "chart.json");
  for (const json& setting : report["pairs"][0]["settings"]) done.push_back(setting["name"]);
  EXPECT_EQ(done, wanted);
  refused.push_back("uv");
  const ProcessResult without_uvs = call_kiln(refused);
  EXPECT_EQ(without_uvs.exit_code, 3);
  EXPECT_NE(without_uvs.errors.find("no UVs"), std::string::npos) << without_uvs.errors;
}

TEST(ChartCommand, ComparesWaysToGatherAmbientOcclusion) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();  // a ring, which darkens itself
  save_obj(test::BumpyTorus::dense(3000), scene / "high.obj");
  save_obj(test::BumpyTorus::light(24, 12), scene / "low.obj");
  const fs::path out = scene / "out";
  const std::vector<std::string> names = {"ao_rays_8", "ao_rays_128", "ao_smooth_32",
                                          "ao_views_64"};
  const ProcessResult result = call_kiln({"chart",
                                          scene / "high.obj",
                                          scene / "low.obj",
                                          "--out",
                                          out,
                                          "--size",
                                          "32",
                                          "--repeat",
                                          "2",
                                          "--max-distance",
                                          "10%",
                                          "--settings",
                                          "ray,ao_rays_8,ao_rays_128,ao_smooth_32,ao_views_64",
                                          "--directions",
                                          "12",
                                          "--pixels",
                                          "64",
                                          "--ao-error",
                                          "1/255",
                                          "--ao-budget",
                                          "1000"},
                                         test::without_python().environment);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(out / "chart.json");
  EXPECT_EQ(report["options"]["ao_settings"].get<std::vector<std::string>>(), names);
  const json& ao = report["pairs"][0]["ao"];
  ASSERT_EQ(ao["settings"].size(), names.size());
  json best, least;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const json& setting = ao["settings"][i];
    EXPECT_EQ(setting["name"], names[i]);
    EXPECT_EQ(setting["runs"].size(), 2U);
    EXPECT_EQ(setting["seconds"], std::min(setting["runs"][0], setting["runs"][1]));
    EXPECT_GT(setting["rms"].get<double>(), 0) << names[i];
    EXPECT_GT(setting["texels"].get<int>(), 500);
    if (best.is_null() || setting["rms"] < best["rms"]) best = setting;
    if (setting["rms"] <= 1.0 / 255 && (least.is_null() || setting["seconds"] < least["seconds"])) {
      least = setting;
    }
    // By their meaning: none is better in one, and no worse in the other.
    const bool beaten =
        std::any_of(ao["settings"].begin(), ao["settings"].end(), [&](const json& other) {
          return other["rms"] <= setting["rms"] && other["seconds"] <= setting["seconds"] &&
                 (other["rms"] < setting["rms"] || other["seconds"] < setting["seconds"]);
        });
    EXPECT_EQ(setting["on_front"].get<bool>(), !beaten) << names[i];
  }
  // 16 times the rays leave less than half of the noise, as smoothing 32 of them does.
  EXPECT_LT(ao["settings"][1]["rms"].get<double>(), 0.5 * ao["settings"][0]["rms"].get<double>());
  EXPECT_LT(ao["settings"][2]["rms"].get<double>(), 0.5 * ao["settings"][0]["rms"].get<double>());
  // The choice is as stated: nearest in 1000 seconds, and the fastest within 1/255 (else the nearest).
  const json& chosen = ao["chosen"];
  EXPECT_EQ(chosen["budget"]["setting"], best["name"]);
  EXPECT_TRUE(chosen["budget"]["reached"].get<bool>());
  EXPECT_EQ(chosen["error"]["reached"].get<bool>(), !least.is_null());
  EXPECT_EQ(chosen["error"]["setting"], least.is_null() ? best["name"] : least["name"]);
  EXPECT_NE(result.output.find("best within 1000 s"), std::string::npos);
  // The flags that it names make such a map: its error as `kiln bake` states it.
  const ProcessResult baked =
      call_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "baked", "--size",
                 "32", "--max-distance", "10%", "--maps", "ao", "--ao-rays", "128", "--ao-error",
                 "1", "--report-error", "--json", scene / "bake.json"});
  ASSERT_EQ(baked.exit_code, 0) << baked.errors;
  EXPECT_EQ(ao["settings"][2]["flags"], "--ao-rays 128 --ao-error 1");
  EXPECT_NEAR(read_json(scene / "bake.json")["errors"][0]["rms"].get<double>() / 255,
              ao["settings"][2]["rms"].get<double>(), 1e-9);

  // Data and picture have the same figures.
  EXPECT_EQ(read_lines(out / "chart_ao.csv").size(), 1 + names.size());
  const json plot = read_json(out / "chart_plot.json");
  const json& panels = plot["groups"][0]["panels"];
  ASSERT_EQ(panels.size(), 5U);
  EXPECT_EQ(panels[4]["name"], "ao_error");
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(panels[4]["marks"][i]["seconds"], ao["settings"][i]["seconds"]);
    EXPECT_NEAR(panels[4]["marks"][i]["error"].get<double>(),
                255 * ao["settings"][i]["rms"].get<double>(), 1e-9);
  }
}

TEST(ChartCommand, TakesSeveralPairsAndNeedsNoPython) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(2000);
  save_obj(test::BumpyTorus::dense(3000), scene / "ring_high.obj");
  save_obj(test::BumpyTorus::light(24, 12), scene / "ring_low.obj");
  const fs::path out = scene / "out";
  const ProcessResult result = call_kiln({"chart",
                                          scene / "high.obj",
                                          scene / "low.obj",
                                          scene / "ring_high.obj",
                                          scene / "ring_low.obj",
                                          "--out",
                                          out,
                                          "--size",
                                          "64",
                                          "--repeat",
                                          "3",
                                          "--max-distance",
                                          "10%",
                                          "--directions",
                                          "12",
                                          "--pixels",
                                          "64",
                                          "--quiet",
                                          "--settings",
                                          "views_6,ray"},
                                         test::without_python().environment);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.output, "");
  EXPECT_TRUE(test::only_warnings(result.errors)) << result.errors;
  const json report = read_json(out / "chart.json");
  // In the chart's own order, and with the reference.
  const std::vector<std::string> names = {"ray", "ray_4x4", "views_6"};
  ASSERT_EQ(report["pairs"].size(), 2U);
  for (const json& pair : report["pairs"]) expect_pair(pair, names, 3);
  EXPECT_NE(report["pairs"][1]["high"]["path"].get<std::string>().find("ring_high"),
            std::string::npos);
  EXPECT_EQ(read_lines(out / "chart.csv").size(), 1 + 2 * names.size());
  EXPECT_FALSE(fs::exists(out / "chart.png"));
  EXPECT_EQ(count_warnings(report, "no-plot", "python3-matplotlib"), 1U);
  // As the warning says: the data and the script that came along are enough for the picture.
  if (!test::has_matplotlib()) return;
  const ProcessResult by_hand = test::run_process(
      {"/bin/sh", "-c",
       "cd '" + out.string() +
           "'; IFS=:; for f in $PATH; do \"$f/python3\" kiln_plot.py chart_plot.json chart.png "
           "2>/dev/null && exit 0; done; exit 1"});
  EXPECT_EQ(by_hand.exit_code, 0);
  EXPECT_EQ(test::read_picture(out / "chart.png").height, 176U + 2 * (106 + 2 * 632));
}

TEST(ChartCommand, RefusesBadUsage) {
  const fs::path scene = make_scene(600);
  const fs::path out = scene / "out";
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  const auto expect = [&](std::vector<std::string> more, int code,
                          const std::vector<std::string>& words) {
    more.insert(more.begin(), "chart");
    const ProcessResult result = call_kiln(more);
    EXPECT_EQ(result.exit_code, code) << result.errors;
    for (const std::string& word : words) {
      EXPECT_NE(result.errors.find(word), std::string::npos) << word << " in " << result.errors;
    }
    EXPECT_TRUE(!fs::exists(out) || fs::is_empty(out));
  };
  expect({"--out", out}, 2, {"HIGH"});
  expect({high, low, "--settings", "ray,guess", "--out", out}, 2, {"guess", "views_12"});
  expect({high, low}, 2, {"--out"});
  expect({high, "--out", out}, 2, {"high.obj", "LOW"});
  expect({high, low, high, "--out", out}, 2, {"high.obj", "LOW"});
  expect({high, low, "--size", "8", "--out", out}, 2, {"--size"});
  expect({high, low, "--repeat", "0", "--out", out}, 2, {"--repeat"});
  expect({high, low, "--directions", "4", "--out", out}, 2, {"--directions"});
  expect({high, low, "--pixels", "8", "--out", out}, 2, {"--pixels"});
  expect({high, low, "--max-distance", "0", "--out", out}, 2, {"--max-distance"});
  expect({high, low, "--ao-error", "2/255", "--out", out}, 2, {"--ao-error", "--ao"});
  expect({high, low, "--ao", "--ao-error", "2/x", "--out", out}, 2, {"2/x", "2/255"});
  expect({high, low, "--ao", "--ao-budget", "0", "--out", out}, 2, {"--ao-budget"});
  expect({high, low, "--sise", "64", "--out", out}, 2, {"--size"});
  expect({high, low, "--out", high + "/such"}, 5, {"high.obj/such"});

  // Not even a mesh with the name of an output is written over.
  const fs::path trap = scene / "chart.csv";
  fs::copy_file(high, trap);
  const auto before = fs::file_size(trap);
  expect({trap, low, "--out", scene}, 2, {"chart.csv"});
  EXPECT_EQ(fs::file_size(trap), before);
}

TEST(ChartCommand, NamesTheRemedyForBadInput) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(200);
  const fs::path out = scene / "out";
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  const auto expect = [&](std::vector<std::string> more, const std::string& word) {
    more.insert(more.begin(), "chart");
    more.insert(more.end(), {"--size", "64", "--out", out});
    const ProcessResult result = call_kiln(more);
    EXPECT_EQ(result.exit_code, 3) << result.errors;
    EXPECT_NE(result.errors.find(word), std::string::npos) << result.errors;
    EXPECT_FALSE(fs::exists(out));  // made for nothing, so gone
  };
  expect({high, high}, "--unwrap");
  expect({scene / "none.ply", low}, "none.ply");
  // The second pair's are looked at before the first one's minutes.
  expect({high, low, scene / "none.ply", low}, "none.ply");
  expect({high, low, high, high}, "--unwrap");
  Mesh away = test::BumpySphere::light(24, 12);
  for (Vec3& position : away.positions) position.x += 100;
  save_obj(away, scene / "away.obj");
  expect({high, scene / "away.obj"}, "move one of them");
}

TEST(ChartCommand, InterruptLeavesNothing) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(20000);
  for (const double after : {0.1, 0.7}) {
    test::expect_interrupt_leaves_nothing({"chart", scene / "high.obj", scene / "low.obj"}, after,
                                          0.6);
  }
}

}  // namespace
}  // namespace kiln
