// kiln chart: figures, front, files, exit codes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "kiln/kiln.h"
#include "support/environment.h"
#include "support/process.h"
#include "support/shapes.h"
#include "support/volumes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::ProcessOptions;
using test::ProcessResult;
using test::run_kiln;

const std::vector<std::string> kSettings = {"ray",
                                            "ray_2x2",
                                            "ray_4x4",
                                            "views_6",
                                            "views_12",
                                            "views_24",
                                            "views_48",
                                            "views_auto",
                                            "views_12_512",
                                            "views_12_1024",
                                            "views_12_2048",
                                            "views_12_4096",
                                            "paper_12",
                                            "views_12_ray",
                                            "closest",
                                            "visibility_texel",
                                            "visibility_vertex",
                                            "visibility_face",
                                            "hybrid"};

fs::path make_scene(std::uint32_t faces) {
  const fs::path folder = test::scratch_folder();
  save_obj(test::BumpySphere::dense(faces), folder / "high.obj");
  save_obj(test::BumpySphere::light(24, 12), folder / "low.obj");
  return folder;
}

json read_json(const fs::path& path) {
  std::ifstream stream(path);
  return json::parse(stream);
}

std::vector<std::string> read_lines(const fs::path& path) {
  std::ifstream stream(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Charts without a picture, which takes Python seconds.
ProcessOptions without_python() {
  ProcessOptions options;
  options.environment = {{"PATH", test::path_without("python3")}};
  return options;
}

/// The picture of so many groups of panels. Beside it lies no script: that is for where there is no picture.
void expect_picture(const fs::path& out, std::uint32_t groups, std::uint32_t lines_of_panels) {
  EXPECT_EQ(fs::exists(out / "kiln_plot.py"), !test::has_matplotlib());
  if (!test::has_matplotlib()) return;
  const Image picture = load_image(out / "chart.png");
  EXPECT_EQ(picture.width, 1900U);
  EXPECT_EQ(picture.height, 176 + groups * (106 + lines_of_panels * 632));
}

std::size_t count_warnings(const json& report, const std::string& code, const std::string& words) {
  std::size_t count = 0;
  for (const json& warning : report["warnings"]) {
    const std::string text = warning.dump();
    count += warning["code"] == code && text.find(words) != std::string::npos ? 1U : 0U;
  }
  return count;
}

json find(const json& pair, const std::string& name) {
  for (const json& setting : pair["settings"]) {
    if (setting["name"] == name) return setting;
  }
  ADD_FAILURE() << "no setting " << name;
  return {};
}

double seconds_of(const json& setting) {
  return setting["seconds"]["correspondence"].get<double>();
}

double error_of(const json& setting, const std::string& measure) {
  if (measure == "object_space" || measure == "uniformity") {
    return setting[measure + "_percent"].get<double>();
  }
  if (measure == "normalised_image_space") return setting[measure].get<double>();
  return setting[measure]["mean_angle_degrees"].get<double>();
}

/// The front by its meaning: walking up the seconds, each that is better than all before it. (By sorting,
/// where the command compares all with all.)
std::vector<std::string> front_of(const json& pair, const std::string& measure) {
  std::vector<json> settings = pair["settings"];
  std::sort(settings.begin(), settings.end(), [&](const json& a, const json& b) {
    return std::pair(seconds_of(a), error_of(a, measure)) <
           std::pair(seconds_of(b), error_of(b, measure));
  });
  std::vector<std::string> names;
  double best = INFINITY;
  for (const json& setting : settings) {
    if (error_of(setting, measure) >= best) continue;
    best = error_of(setting, measure);
    names.push_back(setting["name"]);
  }
  return names;
}

void expect_finite(const json& value, const std::string& where) {
  if (value.is_number()) {
    EXPECT_TRUE(std::isfinite(value.get<double>())) << where;
  } else if (value.is_structured()) {
    for (const auto& [key, item] : value.items()) expect_finite(item, where + "." + key);
  } else if (value.is_null()) {
    ADD_FAILURE() << where << " is null, as numbers that are not finite are written";
  }
}

void expect_pair(const json& pair, const std::vector<std::string>& names, int repeat) {
  ASSERT_EQ(pair["settings"].size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const json& setting = pair["settings"][i];
    EXPECT_EQ(setting["name"], names[i]);
    expect_finite(setting, names[i]);
    EXPECT_GT(seconds_of(setting), 0);
    EXPECT_GT(setting["seconds"]["total"].get<double>(), seconds_of(setting));
    ASSERT_EQ(setting["runs"].size(), static_cast<std::size_t>(repeat));
    std::vector<double> runs;
    for (const json& run : setting["runs"]) runs.push_back(run["correspondence"]);
    std::sort(runs.begin(), runs.end());
    EXPECT_EQ(seconds_of(setting), runs[(runs.size() - 1) / 2]);
    const json& t = setting["texels"];
    EXPECT_EQ(t["samples"].get<int>(), t["outward"].get<int>() + t["inward"].get<int>() +
                                           t["cage"].get<int>() + t["views"].get<int>() +
                                           t["closest"].get<int>() + t["uv"].get<int>() +
                                           t["missed"].get<int>());
    EXPECT_GT(setting["matched_share"].get<double>(), 0.9) << names[i];
    EXPECT_GT(setting["map_error"]["texels"].get<int>(), 1000);
    EXPECT_GT(error_of(setting, "normal_error"), 0);
    EXPECT_LT(error_of(setting, "normal_error"),
              0.5 * pair["normal_error_without_map"]["mean_angle_degrees"].get<double>());
  }
  for (const char* measure :
       {"map_error", "normal_error", "object_space", "normalised_image_space", "uniformity"}) {
    const std::vector<std::string> front = front_of(pair, measure);
    EXPECT_EQ(pair["front"][measure].get<std::vector<std::string>>(), front);
    for (const json& setting : pair["settings"]) {
      const bool on_front =
          std::count(front.begin(), front.end(), setting["name"].get<std::string>()) != 0;
      EXPECT_EQ(setting["on_front"][measure].get<bool>(), on_front) << setting["name"];
    }
  }
}

TEST(ChartCommand, MeasuresEverySetting) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene(8000);
  const fs::path out = scene / "out";
  const std::vector<std::string> arguments = {"chart",
                                              scene / "high.obj",
                                              scene / "low.obj",
                                              "--out",
                                              out,
                                              "--size",
                                              "128",
                                              "--repeat",
                                              "3",
                                              "--max-distance",
                                              "10%"};
  const ProcessResult result = run_kiln(arguments);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(out / "chart.json");
  for (const char* key : {"version", "device", "options", "pairs", "seconds", "memory", "outputs",
                          "warnings", "compile_seconds"}) {
    EXPECT_TRUE(report.contains(key)) << key;
  }
  EXPECT_EQ(report["options"]["size"], 128);
  EXPECT_EQ(report["options"]["repeat"], 3);
  std::vector<std::string> all = kSettings;
  all.emplace_back("uv");
  EXPECT_EQ(report["options"]["settings"].get<std::vector<std::string>>(), all);
  ASSERT_EQ(report["pairs"].size(), 1U);
  const json& pair = report["pairs"][0];
  expect_pair(pair, kSettings, 3);
  ASSERT_EQ(pair["left_out"].size(), 1U);
  EXPECT_EQ(pair["left_out"][0]["setting"], "uv");
  EXPECT_NE(pair["left_out"][0]["reason"].get<std::string>().find("no UVs"), std::string::npos);
  EXPECT_EQ(pair["measured_from"]["views"], 30);
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
  EXPECT_EQ(find(pair, "views_24")["views"]["count"], 24);
  EXPECT_EQ(find(pair, "views_12_2048")["views"]["size"], 2048);
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
  for (std::size_t i = 0; i < kSettings.size(); ++i) {
    std::istringstream line(lines[i + 1]);
    std::vector<std::string> fields;
    for (std::string field; std::getline(line, field, ',');) fields.push_back(field);
    ASSERT_EQ(fields.size(),
              static_cast<std::size_t>(1 + std::count(lines[0].begin(), lines[0].end(), ',')));
    EXPECT_EQ(fields[0], "1");
    EXPECT_EQ(fields[1], kSettings[i]);
    const json setting = find(pair, kSettings[i]);
    EXPECT_NEAR(std::stod(fields[3]), seconds_of(setting), 1e-6);
    EXPECT_NEAR(std::stod(fields[4]), error_of(setting, "map_error"), 1e-6);
    EXPECT_NEAR(std::stod(fields[5]), error_of(setting, "object_space"), 1e-6);
    EXPECT_NEAR(std::stod(fields[6]), error_of(setting, "normalised_image_space"), 1e-6);
    EXPECT_NEAR(std::stod(fields[7]), error_of(setting, "uniformity"), 1e-6);
    EXPECT_NEAR(std::stod(fields[8]), error_of(setting, "normal_error"), 1e-6);
  }
  const std::vector<std::string> table = read_lines(out / "chart.md");
  EXPECT_EQ(std::count_if(table.begin(), table.end(),
                          [](const std::string& line) { return line.starts_with("|"); }),
            static_cast<long>(kSettings.size() + 2));

  // What the picture shows is what the report says.
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
      EXPECT_EQ(mark["runs"].size(), 3U);
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

TEST(ChartCommand, ComparesWaysToGatherAmbientOcclusion) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();  // a ring, which darkens itself
  save_obj(test::BumpyTorus::dense(3000), scene / "high.obj");
  save_obj(test::BumpyTorus::light(24, 12), scene / "low.obj");
  const fs::path out = scene / "out";
  const std::vector<std::string> names = {"ao_rays_8", "ao_rays_128", "ao_smooth_32",
                                          "ao_views_64"};
  const ProcessResult result =
      run_kiln({"chart", scene / "high.obj", scene / "low.obj", "--out", out, "--size", "64",
                "--repeat", "2", "--max-distance", "10%", "--settings",
                "ray,ao_rays_8,ao_rays_128,ao_smooth_32,ao_views_64", "--ao-error", "1/255",
                "--ao-budget", "1000"},
               without_python());
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
    // By their meaning: none is better in both.
    const bool beaten =
        std::any_of(ao["settings"].begin(), ao["settings"].end(), [&](const json& other) {
          return other["rms"] < setting["rms"] && other["seconds"] < setting["seconds"];
        });
    EXPECT_EQ(setting["on_front"].get<bool>(), !beaten) << names[i];
  }
  // 16 times the rays leave less than half of the noise, as smoothing 32 of them does.
  EXPECT_LT(ao["settings"][1]["rms"].get<double>(), 0.5 * ao["settings"][0]["rms"].get<double>());
  EXPECT_LT(ao["settings"][2]["rms"].get<double>(), 0.5 * ao["settings"][0]["rms"].get<double>());
  // What is chosen is what it says: nearest in 1000 seconds, and the fastest within 1/255 (else the nearest).
  const json& chosen = ao["chosen"];
  EXPECT_EQ(chosen["budget"]["setting"], best["name"]);
  EXPECT_TRUE(chosen["budget"]["reached"].get<bool>());
  EXPECT_EQ(chosen["error"]["reached"].get<bool>(), !least.is_null());
  EXPECT_EQ(chosen["error"]["setting"], least.is_null() ? best["name"] : least["name"]);
  EXPECT_NE(result.output.find("nearest to the truth within 1000 s"), std::string::npos);
  // The flags that it names make such a map: its error as `kiln bake` states it.
  const ProcessResult baked =
      run_kiln({"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "baked", "--size",
                "64", "--max-distance", "10%", "--maps", "ao", "--ao-rays", "128", "--ao-error",
                "1", "--json", scene / "bake.json"});
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
  const ProcessResult result =
      run_kiln({"chart", scene / "high.obj", scene / "low.obj", scene / "ring_high.obj",
                scene / "ring_low.obj", "--out", out, "--size", "64", "--repeat", "1",
                "--max-distance", "10%", "--quiet", "--settings", "views_12_512,views_6,ray"},
               without_python());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.output, "");
  EXPECT_TRUE(test::only_warnings(result.errors)) << result.errors;
  const json report = read_json(out / "chart.json");
  // In the chart's own order, and with the reference.
  const std::vector<std::string> names = {"ray", "ray_4x4", "views_6", "views_12_512"};
  ASSERT_EQ(report["pairs"].size(), 2U);
  for (const json& pair : report["pairs"]) expect_pair(pair, names, 1);
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
  EXPECT_EQ(load_image(out / "chart.png").height, 176U + 2 * (106 + 2 * 632));
}

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
      run_kiln({"chart", scene / "ball.nrrd", scene / "small.nrrd", "--iso", "127.5", "--faces",
                "600", "--size", "256", "--repeat", "2", "--out", out});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = read_json(out / "chart.json");
  EXPECT_EQ(report["options"]["iso"], 127.5);
  EXPECT_EQ(report["options"]["faces"], 600);
  ASSERT_EQ(report["volumes"].size(), 2U);
  const std::vector<std::string> names = {
      "none",    "direct_128",  "direct_256",   "direct_512",  "ray_128",     "ray_256",
      "ray_512", "ray_2x2_256", "views_12_256", "closest_128", "closest_256", "closest_512"};
  for (const json& volume : report["volumes"]) {
    EXPECT_LE(volume["light"]["faces"], 600);
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
      ASSERT_EQ(setting["runs"].size(), 2U);
      EXPECT_EQ(s["build"] > 0, setting.contains("texels"));
    }
    // Every map is far nearer than none, by either measure; a map of 256 texels a side is large enough
    // for the ways to agree.
    const double none = find(volume, "none")["gradient_error"]["mean_angle_degrees"];
    EXPECT_GT(none, 3);
    for (const char* name : {"direct_256", "ray_256", "ray_2x2_256", "closest_256"}) {
      const json setting = find(volume, name);
      EXPECT_LT(setting["gradient_error"]["mean_angle_degrees"], 0.5 * none) << name;
      EXPECT_LT(setting["gradient_error_along_face"]["mean_angle_degrees"], 0.5 * none) << name;
      EXPECT_LT(error_of(setting, "normal_error"),
                0.6 * error_of(find(volume, "none"), "normal_error"))
          << name;
    }
  }
  // The same volume in other units: the same errors.
  for (const char* name : {"none", "direct_256", "ray_256"}) {
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
  const ProcessResult result = run_kiln(
      {"chart", scene / "ball.raw", "--raw-size", "48x48x48", "--iso", "127.5", "--error", "0.5",
       "--size", "128", "--repeat", "1", "--settings", "ray_2x2,direct", "--quiet", "--out", out},
      without_python());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.output, "");
  EXPECT_TRUE(test::only_warnings(result.errors)) << result.errors;
  const json report = read_json(out / "chart.json");
  std::vector<std::string> names;
  for (const json& setting : report["volumes"][0]["settings"]) names.push_back(setting["name"]);
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
    const ProcessResult refused = run_kiln(more);
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
  refuse({ball, "--iso", "3", "--settings", "ray", "closest"}, 2, "separated by commas");
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
    return run_kiln({"chart", scene / "high.obj", low, "--out", out, "--size", "64", "--repeat",
                     "1", "--max-distance", "10%", "--quiet", "--settings", settings},
                    without_python());
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
  EXPECT_NE(refused.errors.find("do not lie over each other"), std::string::npos) << refused.errors;
  EXPECT_FALSE(fs::exists(scene / "none"));
}

TEST(ChartCommand, TakesHeightFields) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = test::scratch_folder();
  Image image{33, 33, 1, std::vector<float>(33 * 33)};
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
                                              "--settings",
                                              "ray,uv"};
  // One Python without matplotlib, and then one that fails: its own words are what to go by.
  ProcessOptions options;
  options.environment = {{"PATH", test::folder_with("python3", "exit 69") + ":" +
                                      test::folder_with("python3", "echo broken >&2; exit 5") +
                                      ":" + test::path_without("python3")}};
  const ProcessResult result = run_kiln(arguments, options);
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
    return run_kiln(more);
  };
  EXPECT_EQ(mesh_chart({"--max-distance", "40%"}).exit_code, 3);
  EXPECT_EQ(mesh_chart({"--height", "0.3"}).exit_code, 2);
  EXPECT_EQ(run_kiln({"chart", scene / "field.png", scene / "low.obj", "--extent", "x", "--out",
                      scene / "none"})
                .exit_code,
            2);
}

TEST(ChartCommand, RefusesBadUsage) {
  const fs::path scene = make_scene(600);
  const fs::path out = scene / "out";
  const std::string high = scene / "high.obj";
  const std::string low = scene / "low.obj";
  const auto expect = [&](std::vector<std::string> more, int code,
                          const std::vector<std::string>& words) {
    more.insert(more.begin(), "chart");
    const ProcessResult result = run_kiln(more);
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
  expect({high, low, "--max-distance", "0", "--out", out}, 2, {"--max-distance"});
  expect({high, low, "--ao-error", "2/255", "--out", out}, 2, {"--ao-error", "--ao"});
  expect({high, low, "--ao", "--ao-error", "2/x", "--out", out}, 2, {"2/x", "2/255"});
  expect({high, low, "--ao", "--ao-budget", "0", "--out", out}, 2, {"--ao-budget"});
  expect({high, low, "--sise", "64", "--out", out}, 2, {"--size"});
  expect({high, low, "--out", scene / "no/such"}, 5, {"no/such"});

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
    const ProcessResult result = run_kiln(more);
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
  for (const double delay : {0.3, 2.0}) {
    const fs::path out = scene / ("out" + std::to_string(delay));
    ProcessOptions options;
    options.interrupt_after_seconds = delay;
    const ProcessResult result =
        run_kiln({"chart", scene / "high.obj", scene / "low.obj", "--out", out}, options);
    EXPECT_EQ(result.exit_code, 130) << result.errors;
    EXPECT_LT(result.seconds_after_signal, 0.6);
    EXPECT_TRUE(!fs::exists(out) || fs::is_empty(out));
  }
}

}  // namespace
}  // namespace kiln
