// --high-normals: hard surfaces whose files have no normals.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/bake.h"
#include "support/environment.h"
#include "support/json_file.h"
#include "support/pictures.h"
#include "support/process.h"
#include "support/shapes.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_exit;
using test::ProcessResult;
using Words = std::vector<std::string>;

void save_stl(const Mesh& mesh, const fs::path& path) {
  std::ofstream out(path);
  out << "solid cube\n";
  for (const Triangle& t : mesh.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t v : t) {
      const Vec3& p = mesh.positions[v];
      out << "vertex " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid cube\n";
}

/// A cube as STL, and as a low poly with hard edges.
fs::path cube_scene() {
  const fs::path folder = test::scratch_folder();
  const Mesh cube = test::cube(1, 0.05);
  save_stl(cube, folder / "high.stl");
  save_obj(cube, folder / "low.obj");
  return folder;
}

ProcessResult bake(const fs::path& scene, const Words& more) {
  Words words = {"bake", scene / "high.stl", scene / "low.obj",    "--out", scene / "out", "--size",
                 "64",   "--json",           scene / "report.json"};
  words.insert(words.end(), more.begin(), more.end());
  return call_kiln(words);
}

/// The greatest angle of a map's normals to +Z, degrees.
double most_tilt(const fs::path& map) {
  const Image image = test::read_picture(map.string());
  double most = 0;
  for (std::size_t i = 0; i + 2 < image.pixels.size(); i += image.channels) {
    const double x = 2 * double{image.pixels[i]} - 1, y = 2 * double{image.pixels[i + 1]} - 1,
                 z = 2 * double{image.pixels[i + 2]} - 1;
    most = std::max(most, std::atan2(std::hypot(x, y), z) * 180 / std::numbers::pi);
  }
  return most;
}

bool warns(const nlohmann::json& report, const std::string& code) {
  return std::any_of(report["warnings"].begin(), report["warnings"].end(),
                     [&](const auto& warning) { return warning["code"] == code; });
}

TEST(HighNormals, FlatsOfAnStlAreFlat) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = cube_scene();
  const ProcessResult result = bake(scene, {});
  expect_exit(result, 0, {});
  EXPECT_NE(result.output.find("12 hard edges in 1 of 1 part, of 90 degrees or more"),
            std::string::npos)
      << result.output;
  EXPECT_NE(result.output.find("the file has none (--high-normals auto)"), std::string::npos);
  const auto report = test::read_json(scene / "report.json");
  EXPECT_EQ(report["high_normals"]["chosen"], "hard_edges");
  EXPECT_EQ(report["high_normals"]["hard_edges"], 12);
  EXPECT_EQ(report["options"]["high_normals"], "auto");
  EXPECT_FALSE(warns(report, "bent-planes"));
  // Half a step of 16 bits in x and y each: 0.0013 degrees.
  EXPECT_LT(most_tilt(scene / "out" / "low_normal.png"), 0.002);
}

TEST(HighNormals, AreAsAsked) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = cube_scene();
  for (const auto& [rule, chosen, flat] :
       {std::tuple("smooth", "smooth", false), std::tuple("file", "smooth", false),
        std::tuple("flat", "flat", true), std::tuple("90", "hard_edges", true),
        std::tuple("90.5", "smooth", false)}) {
    expect_exit(bake(scene, {"--high-normals", rule}), 0, {});
    const auto report = test::read_json(scene / "report.json");
    EXPECT_EQ(report["high_normals"]["chosen"], chosen) << rule;
    EXPECT_EQ(report["options"]["high_normals"], rule);
    EXPECT_EQ(warns(report, "bent-planes"), !flat) << rule;
    const double tilt = most_tilt(scene / "out" / "low_normal.png");
    EXPECT_EQ(tilt < 0.002, flat) << rule << tilt;
  }
  for (const char* wrong : {"soft", "0", "-30", "181", "nan"}) {
    expect_exit(bake(scene, {std::string("--high-normals=") + wrong}), 2, {"high-normals"});
  }
}

TEST(HighNormals, SimplifyFitsThem) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = cube_scene();
  const auto flats = [&](const Words& more) {
    Words words = {"simplify", scene / "high.stl", "--faces",   "12",
                   "--out",    scene / "made.obj", "--normals", "shading"};
    words.insert(words.end(), more.begin(), more.end());
    expect_exit(call_kiln(words), 0, {});
    const Mesh low = load_mesh(scene / "made.obj");
    return std::count_if(low.normals.begin(), low.normals.end(), [](const Vec3& n) {
             return std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)}) > 0.999F;
           }) == static_cast<std::ptrdiff_t>(low.normals.size());
  };
  EXPECT_TRUE(flats({}));
  EXPECT_FALSE(flats({"--high-normals", "smooth"}));
}

TEST(HighNormals, RenderSaysThatAMapOfSmoothNormalsDoesNotFit) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = cube_scene();
  const auto warned = [&](const char* baked) {
    expect_exit(bake(scene, {"--high-normals", baked}), 0, {});
    const ProcessResult result =
        call_kiln({"render", scene / "low.obj", "--normal", scene / "out" / "low_normal.png",
                   "--reference", scene / "high.stl", "--out", scene / "seen.png", "--size", "64",
                   "--json", scene / "seen.json"});
    expect_exit(result, 0, {});
    const auto report = test::read_json(scene / "seen.json");
    EXPECT_FALSE(warns(report, "green-flipped"));
    return report["rendered_normals"]["with_map"]["mean_angle_degrees"].get<double>();
  };
  EXPECT_LT(warned("auto"), 0.1);
  EXPECT_GT(warned("smooth"), 10);
}

TEST(HighNormals, AreForAllCommandsThatReadHigh) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = cube_scene();
  expect_exit(bake(scene, {"--high-normals", "smooth"}), 0, {});
  // With the high poly's normals as smooth as those that were baked, the map fits.
  expect_exit(call_kiln({"render", scene / "low.obj", "--normal", scene / "out" / "low_normal.png",
                         "--reference", scene / "high.stl", "--high-normals", "smooth", "--out",
                         scene / "seen.png", "--size", "64", "--json", scene / "seen.json"}),
              0, {});
  EXPECT_LT(
      test::read_json(scene / "seen.json")["rendered_normals"]["with_map"]["mean_angle_degrees"]
          .get<double>(),
      1);
  expect_exit(call_kiln({"render", scene / "low.obj", "--high-normals", "smooth", "--out",
                         scene / "seen.png"}),
              2, {"--reference"});

  const Words sizes = {"--size", "16", "--pixels", "32"};
  const auto call = [&](Words words, const Words& more) {
    words.insert(words.end(), sizes.begin(), sizes.end());
    words.insert(words.end(), more.begin(), more.end());
    return call_kiln(words);
  };
  const Words measure = {
      "measure", scene / "high.stl", scene / "low.obj",   "--match", "ray", "--directions",
      "12",      "--json",           scene / "rated.json"};
  const auto warns_of_bent_planes = [&](const fs::path& report) {
    return warns(test::read_json(report), "bent-planes");
  };
  for (const bool smooth : {false, true}) {
    const Words rule = {"--high-normals", smooth ? "smooth" : "flat"};
    expect_exit(call(measure, rule), 0, {});
    EXPECT_EQ(warns_of_bent_planes(scene / "rated.json"), smooth);
    expect_exit(
        call({"gallery", scene / "high.stl", scene / "low.obj", "--match", "ray", "--picture-size",
              "64", "--out", scene / "gallery", "--json", scene / "gallery.json"},
             rule),
        0, {});
    EXPECT_EQ(warns_of_bent_planes(scene / "gallery.json"), smooth);
    expect_exit(call({"chart", scene / "high.stl", scene / "low.obj", "--settings", "ray",
                      "--repeat", "1", "--directions", "12", "--out", scene / "chart"},
                     rule),
                0, {});
    EXPECT_EQ(warns_of_bent_planes(scene / "chart" / "chart.json"), smooth);
  }
  // A mesh alone is rated by its UVs, for which normals of HIGH do not matter.
  EXPECT_EQ(call_kiln({"measure", scene / "low.obj", "--high-normals", "flat"}).exit_code, 2);
}

TEST(HighNormals, OfADrilledPart) {
  KILN_REQUIRE_DEVICE();
  KILN_REQUIRE_DATA("cases/stl_cad");
  const fs::path data = *test::shared_data("cases/stl_cad"), folder = test::scratch_folder();
  expect_exit(
      call_kiln({"simplify", data / "part.stl", "--faces", "200", "--out", folder / "low.obj"}), 0,
      {});
  const auto map_of = [&](const char* stem, const char* ending) {
    expect_exit(call_kiln({"bake", data / (std::string(stem) + ending), folder / "low.obj", "--out",
                           folder / stem, "--size", "256", "--format", "exr32"}),
                0, {});
    return test::read_picture((folder / stem / "low_normal.exr").string());
  };
  const Image made = map_of("part", ".stl"), right = map_of("part_right", ".obj");
  double sum = 0;
  for (std::size_t i = 0; i < made.pixels.size(); i += 3) {
    double a[3], b[3];
    for (std::size_t k = 0; k < 3; ++k) {
      a[k] = 2 * double{made.pixels[i + k]} - 1;
      b[k] = 2 * double{right.pixels[i + k]} - 1;
    }
    const double sine =
        std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
    sum += std::atan2(sine, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * 180 / std::numbers::pi;
  }
  EXPECT_LT(sum / static_cast<double>(made.pixels.size() / 3), 0.2);  // the bound
}

}  // namespace
}  // namespace kiln
